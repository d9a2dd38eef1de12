"""What someone might write into the data of the thesis's page by mistake, one at a time.

Each entry is the name of an item, or of a command after "run ", with the keys that it gets.
"""

BEFORE = (
    ("figures 27–29", {"schematic": True}),
    ("figure 43", {"schematic": True}),
    ("run sensitivity", "deboom run sensitivity"),
    ("run vehicles", "deboom run correlation --group XYZ"),
    ("table 9", {"code": ["sound_level.splv"]}),
    ("figure 16", {"code": ["examples/mounts/plot_dynamic_stiffness.py"]}),
    ("figure 44", {"code": ["sound_level.splv"]}),
    ("figure 14", {"sections": ["Force transfer matrices"]}),
    ("figures 19, 21", {"files": ["static_*", "r2"]}),
    ("figure 18", {"files": ["directions"]}),
    ("table 3", {"see": "virtual, in `src/deboom/bench/data/engine.json`"}),
    ("figure 14", {"files": ["rebuilt"]}),
    ("figure 48", {"files": ["sobols"]}),
    ("figure 52", {"files": ["figure_52"]}),
    ("figure 53", {"files": ["inertance"]}),
)
"""Those of an audit: the first eleven passed a test that read names only."""

NEW = (
    ("run compressor", "deboom identify --pairs"),
    ("run mounts", "deboom run mounts"),
    ("run cabin", "deboom unbalance"),
    ("table 6", {"files": ["truth"]}),
    ("figure 61", {"files": ["figure_62_hoses"]}),
    ("figures 66, 67 of the appendix", {"files": ["figure_66_inertance"]}),
    ("figure 53", {"schematic": True}),
    ("figure 10", {"run": "vehicles"}),
    ("figure 45", {"run": "groups"}),
    ("run front", "deboom run front --sampler stale"),
    ("tables 10, 11", {"numbers": [{"what": "rank", "thesis": "44", "key": "rank"}]}),
    ("figure 54", {"sections": ["The thesis's numbers"]}),
    ("figures 12, 13", {"see": "`deboom bench campaign` writes a virtual one"}),
    ("figure 61", {"see": "`deboom bench operation operation --mount-stiffness 0.9`"}),
    ("figures 23–25", {"name": "figures 23, 24"}),
)
"""Further ones, written before the test that catches them."""
