"""A model as a node of other programs: the numbers are a run's own, and failures keep their row."""

import io
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import deboom
from command_line import call, refused
from deboom.cli import app
from deboom.errors import InputError
from deboom.explore.front import replicates
from deboom.files.dakota import read_dakota
from deboom.runs.evaluate import Node, evaluate_dakota, evaluate_lines, evaluate_table, opened_node

PLATFORM = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"


def texts(path):
    return pd.read_csv(path, dtype=str, keep_default_na=False)


def test_numbers_of_a_run_are_those_of_its_front(front_run, tmp_path):
    out = tmp_path / "results.csv"
    call("evaluate", front_run, front_run / "front.csv", "-o", out, "--verified")
    front, results = texts(front_run / "front.csv"), texts(out)
    compared = [name for name in results if name in front]
    assert {"TSM x [1]", "SPLV mean sum in search [dB(A)]", "SPLV sigma sum [dB]"} <= set(compared)
    pd.testing.assert_frame_equal(results[compared], front[compared])
    sums = results["SPLV mean sum in search [dB(A)]"].astype(float)
    levels = results.filter(regex="^level of ").astype(float)
    n_lines = opened_node(front_run).robust.evaluate.n_lines
    np.testing.assert_allclose(n_lines * levels.sum(axis=1), sums)
    assert set(results["error"]) == {""}


def test_a_platform_has_the_numbers_of_its_front(front_run, tmp_path):
    designs = tmp_path / "designs.csv"
    space = opened_node(front_run).space
    rows = texts(front_run / "front.csv")[list(space.labels)].astype(float).to_numpy()[:3]
    deboom.write_designs(designs, space, ["level [dB(A)]"], designs=rows)
    out = tmp_path / "results.csv"
    call("evaluate", PLATFORM, designs, "-o", out, "--draws", 16, "--seed", 1)
    front, results = texts(front_run / "front.csv")[:3], texts(out)
    for name in ("SPLV mean sum in search [dB(A)]", "SPLV sigma sum in search [dB]"):
        assert list(results[name]) == list(front[name])
    assert list(results["design"]) == ["1", "2", "3"]


def test_lines_are_answered_one_by_one(front_run):
    """A process waits for the answer of a line before it writes the next one."""
    header, *rows = (front_run / "front.csv").read_text().splitlines()[:3]
    words = (sys.executable, "-m", "deboom", "evaluate", front_run, "--stdin")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    answers = []
    with subprocess.Popen(words, **pipes) as process:
        for line in (header, *rows, rows[0].replace(",", "", 1)):
            process.stdin.write(f"{line}\n")
            process.stdin.flush()
            answers.append(process.stdout.readline())
        process.stdin.close()
        assert process.wait() == 3
    results = pd.read_csv(io.StringIO("".join(answers)), dtype=str, keep_default_na=False)
    front = texts(front_run / "front.csv")
    name = "SPLV mean sum in search [dB(A)]"
    assert list(results[name]) == [*front[name][:2], ""]
    assert re.fullmatch(r"the line has \d+ cells, and the first one \d+", results["error"][2])


def test_what_belongs_together_is_said(front_run, tmp_path):
    designs = front_run / "front.csv"
    for words in ((), (designs,), ("-o", "r.csv"), (designs, "-o", "r.csv", "--stdin")):
        refused(("evaluate", front_run, *words), "give DESIGNS with -o RESULTS, or --stdin alone")
    refused(("evaluate", front_run, designs, "-o", "r.csv", "--seed", 2), "has its own")
    pd.read_csv(designs).drop(columns="TSM x [1]").to_csv(tmp_path / "d.csv", index=False)
    sentence = "d.csv: column 'TSM x [1]' is missing: every variable needs one"
    refused(("evaluate", front_run, tmp_path / "d.csv", "-o", "r.csv"), sentence)


GUIDE = (Path(__file__).parents[2] / "docs/guides/from-modefrontier.md").read_text("utf-8")


def test_the_guide_shows_the_node(front_run, tmp_path, monkeypatch):
    """Its designs, its commands, and Dakota's file with the driver that it states."""
    monkeypatch.chdir(tmp_path)
    Path("my_platform").symlink_to(PLATFORM)
    section = GUIDE.partition("## deboom as a node")[2].partition("\n## ")[0]
    (code,) = re.findall(r"```python\n(.*?)```", section, re.S)
    exec(compile(code, "guide.md", "exec"), {})
    table, lines = re.findall(r"```sh\n(.*?)```", section, re.S)
    call(*table.split()[1:])
    results = texts("results.csv")
    assert (len(results), set(results["error"])) == (32, {""})
    named = re.findall(r"^\| (`.*?) \|", section, re.M)
    for name in re.findall(r"`(.*?)`", " ".join(named)):
        pattern = re.escape(name).replace("VEHICLE", r"U06\-1")
        assert name.startswith("beyond") or any(re.fullmatch(pattern, each) for each in results)
    typed = "".join(Path("designs.csv").read_text().splitlines(keepends=True)[:2])
    answer = CliRunner().invoke(app, lines.split()[1:], input=typed).stdout
    assert answer.splitlines() == Path("results.csv").read_text().splitlines()[:2]
    (driver,) = re.findall("analysis_drivers = 'deboom (.*?)'", section)
    variables, responses = (
        re.findall(r"'(.*?)'", block) for block in re.findall(r"descriptors([^=]*?)\n +\w", section)
    )
    rows = [f"{len(variables)} variables", *(f"1.0 {name}" for name in variables)]
    rows += [f"{len(responses)} functions"]
    rows += [f"1 ASV_{k}:{name}" for k, name in enumerate(responses, 1)]
    Path("params.in").write_text("\n".join(rows))
    call(*driver.split())
    assert len(Path("results.out").read_text().splitlines()) == len(responses) == 2
    assert len(variables) == 12


# ---- failures, limits and Dakota, on a small model


def level(designs):
    if np.any(designs[:, 0] > 290.0):
        raise ZeroDivisionError("no stop left")
    return np.column_stack([designs[:, 0] / 10.0, designs[:, 1] ** 2])


@pytest.fixture(scope="module")
def node():
    model = deboom.ResponseFunction(level, ("k x", "c"), ("van", "car"), "dB")
    space = deboom.DesignSpace(
        ("k x", "c"), ("N/mm", "1"), [250.0, 1.0], [200.0, 0.5], [300.0, 1.5], [0.01, 0.15]
    )
    sag = deboom.ResponseFunction(lambda x: 1e3 / x[:, :1], ("k x", "c"), ("sag",), "mm")
    limits = [
        deboom.Objective("mean", response="van").at_most(25.0),
        deboom.Objective("nominal", response=sag, label="sag").at_most(4.0),
    ]
    robust = deboom.Robust(model, space, draws=16, limits=limits)
    return Node(robust, replicates(robust, 16, seed=1))


def written(path, *rows, header="design,k x [N/mm],c [1],remark"):
    path.write_text("\n".join([header, *rows, ""]))
    return path


def test_rows_that_fail_say_why_and_the_others_have_numbers(node, tmp_path):
    designs = written(
        tmp_path / "d.csv", "a,220,1,", "b,199,1,x", "c,220,high,", "d,299,1,", "e,,1,", "f,260,1,"
    )
    assert evaluate_table(node, designs, tmp_path / "r.csv") == 4
    results = texts(tmp_path / "r.csv").set_index("design")
    assert list(results.index) == list("abcdef")
    errors = dict(results["error"])
    assert "no stop left" in errors.pop("d")
    assert errors == {
        "a": "",
        "b": "'k x' is 199, outside its bounds 200 to 300 [N/mm]: correct it or widen the bounds",
        "c": "'c' is 'high', no finite number",
        "e": "'k x' is '', no finite number",
        "f": "",
    }
    numbers = results[list(node.labels)]
    assert (numbers.loc[list("bcde")] == "").all(axis=None)
    assert (numbers.loc[["a", "f"]] != "").all(axis=None)
    assert list(results["k x [N/mm]"]) == ["220.0", "199.0", "220.0", "299.0", "", "260.0"]


def test_limits_are_told_by_how_much_a_design_is_beyond_them(node, tmp_path):
    designs = written(tmp_path / "d.csv", "1,220,1,", "2,260,1,")
    evaluate_table(node, designs, tmp_path / "r.csv")
    results = pd.read_csv(tmp_path / "r.csv")
    mean = results["mean of van [dB]"]
    np.testing.assert_allclose(results["beyond mean, van at most 25 dB [dB]"], mean - 25.0)
    sag = 1e3 / results["k x [N/mm]"] - 4.0
    np.testing.assert_allclose(results["beyond sag at most 4 mm [mm]"], sag)
    values = node.robust(np.array([[220.0, 1.0], [260.0, 1.0]]))
    np.testing.assert_array_equal(results["mean sum in search [dB]"], values.mean_sum)
    np.testing.assert_array_equal(results["sigma of car [dB]"], values.sigma[:, 1])
    checked = node.judge(values.designs)
    np.testing.assert_array_equal(results["mean sum [dB]"], checked.mean_sum)


def test_units_of_a_header_are_converted_and_others_refused(node, tmp_path):
    header = "c,k x [N/m]"
    for row, name in (("1,220000", "r.csv"), ("1,220000", "r.xlsx")):
        designs = written(tmp_path / "d.csv", row, header=header)
        assert evaluate_table(node, designs, tmp_path / name) == 0
    assert texts(tmp_path / "r.csv")["k x [N/mm]"][0] == "220.0"
    book = pd.read_excel(tmp_path / "r.xlsx")
    assert book["mean of van [dB]"][0] == pd.read_csv(tmp_path / "r.csv")["mean of van [dB]"][0]
    for header in ("c,k x [mm]", "c,k x"):
        designs = written(tmp_path / "d.csv", "1,220", header=header)
        with pytest.raises(InputError, match=r"d.csv: column 'k x.*' is not in N/mm: state its u"):
            evaluate_table(node, designs, tmp_path / "r.csv")


def test_lines_that_are_none_keep_their_answer(node):
    lines = ["k x [N/mm], c [1]\n", "220, 1\n", "\n", "220,1,1\n", "220,x\n", "260,1\n"]
    answers = list(evaluate_lines(node, lines))
    assert [failed for _, failed in answers] == [False, False, True, True, True, False]
    table = pd.read_csv(io.StringIO("".join(line for line, _ in answers)))
    assert list(table["design"]) == [1, 2, 3, 4, 5]
    assert list(table["mean of van [dB]"].isna()) == [False, True, True, True, False]
    with pytest.raises(InputError, match=r"standard input: column 'c .1.' is missing"):
        next(evaluate_lines(node, ["k x [N/mm]\n"]))


STANDARD = """                    2 variables
 {k} k_x
 1.000000000000000e+00 c
                    3 functions
                    1 ASV_1:mean_sum_in_search
                    0 ASV_2:sigma_sum_in_search
                    1 ASV_3:beyond_sag_at_most_4_mm
                    1 derivative_variables
                    1 DVV_1:k_x
                    1 analysis_components
               a.mesh AC_1:deboom
                    7 eval_id
"""
APREPRO = """                    { DAKOTA_VARS     =                      2 }
                    { k_x             =  {k} }
                    { c               =  1.000000000000000e+00 }
                    { DAKOTA_FNS      =                      3 }
                    { ASV_1:mean_sum_in_search =             1 }
                    { ASV_2:sigma_sum_in_search =            0 }
                    { ASV_3:beyond_sag_at_most_4_mm =        1 }
                    { DAKOTA_DER_VARS =                      1 }
                    { DVV_1:k_x       =                      1 }
                    { DAKOTA_AN_COMPS =                      1 }
                    { AC_1:deboom     = "a.mesh" }
                    { DAKOTA_EVAL_ID  =                      7 }
"""


@pytest.mark.parametrize("form", [STANDARD, APREPRO])
def test_files_of_dakota(node, tmp_path, form):
    parameters, results = tmp_path / "params.in", tmp_path / "results.out"
    parameters.write_text(form.replace("{k}", "2.200000000000000e+02"))
    assert evaluate_dakota(node, parameters, results) == 0
    values = node.robust(np.array([[220.0, 1.0]]))
    assert results.read_text() == (
        f"{float(values.mean_sum[0])!r} mean_sum_in_search\n"
        f"{float(values.excess[0, 1])!r} beyond_sag_at_most_4_mm\n"
    )
    parameters.write_text(form.replace("{k}", "2.990000000000000e+02"))
    assert evaluate_dakota(node, parameters, results) == 1
    first, reason = results.read_text().splitlines()
    assert (first, "no stop left" in reason) == ("FAIL", True)


def test_the_command_knows_files_of_dakota(front_run, tmp_path):
    """Both by their content, whatever they are called."""
    front = texts(front_run / "front.csv")
    labels = opened_node(front_run).space.labels
    names = [re.sub(r"\W+", "_", label.removesuffix(" [1]")) for label in labels]
    lines = [f"{len(names)} variables"]
    lines += [f"{front[label][0]} {name}" for label, name in zip(labels, names, strict=True)]
    lines += [
        "1 functions",
        "1 ASV_1:SPLV_mean_sum_in_search",
        "0 derivative_variables",
        "1 eval_id",
    ]
    (tmp_path / "p.csv").write_text("\n".join(lines))
    call("evaluate", front_run, tmp_path / "p.csv", "-o", tmp_path / "r")
    mean = front["SPLV mean sum in search [dB(A)]"][0]
    assert (tmp_path / "r").read_text() == f"{mean} SPLV_mean_sum_in_search\n"
    (tmp_path / "p.csv").write_text("\n".join(lines).replace(f"{front[labels[0]][0]} ", "3 "))
    call("evaluate", front_run, tmp_path / "p.csv", "-o", tmp_path / "r", code=3)
    assert (tmp_path / "r").read_text().startswith("FAIL\n")


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("k_x\n", "k\n", "descriptors of variables: 'k' is not one of k_x, c"),
        ("                    2 variables\n {k} k_x\n", "1 variables\n", "'k_x' is not one of c: "),
        ("ASV_1:mean_sum_in", "ASV_1:mean_in", "of responses: 'mean_in_search' is not one of mean"),
        ("1 ASV_1", "3 ASV_1", "wants derivatives of mean_sum_in_search, and deboom gives values"),
        ("7 eval_id", "7 eval_id\n 1 metadata\n seconds MD_1", "Dakota wants metadata"),
        ("                    3 functions", "9 functions", "is no whole file of Dakota's param"),
    ],
)
def test_what_dakota_may_not_want_is_said(node, tmp_path, old, new, sentence):
    path = tmp_path / "params.in"
    assert old in STANDARD
    path.write_text(STANDARD.replace(old, new).replace("{k}", "220"))
    with pytest.raises(InputError, match=re.escape(sentence)) as caught:
        evaluate_dakota(node, path, tmp_path / "results.out")
    assert str(caught.value).startswith(f"{path}")
    assert not (tmp_path / "results.out").exists()


def test_a_file_of_dakota_that_is_cut_anywhere_is_refused(tmp_path):
    path, text = tmp_path / "params.in", STANDARD.replace("{k}", "220")
    for end in range(1, text.index("1 derivative_variables") - 60, 13):
        path.write_text(text[:end])
        with pytest.raises(InputError, match=r"is no whole file|cannot be read"):
            read_dakota(path)
