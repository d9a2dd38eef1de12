"""The table of a sheet's words: every label in both languages comes from it, by its key."""

import string

import numpy as np
import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.files.acceptance import SheetDirection, SupplierSpecification
from deboom.files.supplier_words import WORDS, decimals_of, label, labelled, said
from deboom.language import Language
from deboom.supplier.acceptance import CAPABILITY, SUPPLIER_BATCHES
from deboom.supplier.page import TEST_ENDS
from deboom.supplier.sheet import AT_STATE, RATIO

NONE = dict.fromkeys(set(SheetDirection.model_fields) - {"name", "duty"})
SPECIFICATION = SupplierSpecification(
    mount="TSM",
    revision="",
    language="en",
    box_sha256="",
    share_stated=None,
    uncertainty=None,
    directions=(SheetDirection(name="TSM x", duty="free", **NONE),),
)
TABLES = {
    "block": tuple(dict.fromkeys((*RATIO, *AT_STATE))),
    "test": (*TEST_ENDS, "nominal_real", "nominal_imaginary", "loss_angle", "decides"),
    "fill in": SPECIFICATION.fill_in,
    "batches": SUPPLIER_BATCHES,
    "capability": tuple(key for key in CAPABILITY if key != "outside"),
}


@pytest.mark.parametrize("language", list(Language))
@pytest.mark.parametrize("table", TABLES)
def test_labels_of_a_table_are_words_of_the_table_and_tell_columns_apart(table, language):
    labels = [label(key, language) for key in TABLES[table]]
    assert len(set(labels)) == len(labels)
    frame = pd.DataFrame([dict.fromkeys(TABLES[table], 1.0)])
    assert list(labelled(frame, language)) == labels
    assert set(decimals_of(frame, language)) <= set(labels)


def test_both_languages_say_the_same_with_the_same_numbers():
    def places(text):
        return sorted(name for _, name, _, _ in string.Formatter().parse(text) if name)

    for key, word in WORDS.items():
        assert word.en.strip(), key
        assert word.de.strip(), key
        assert places(word.en) == places(word.de), key


def test_a_unit_stands_in_the_label_and_may_be_the_programmes():
    assert label("cpk", Language.de) == "Cpk mindestens [1]"
    assert label("gain", Language.de).endswith("[0,001 dB]")
    assert label("saving", Language.en, "EUR") == "saving [EUR]"
    frame = pd.DataFrame({"saving": [0.5], "direction": ["TSM x"]})
    assert list(labelled(frame, Language.en, {"saving": "USD"})) == ["saving [USD]", "direction"]
    assert decimals_of(pd.DataFrame({"lower_share": [np.nan]}), Language.en) == {}


def test_a_key_that_is_no_word_is_refused_by_name():
    with pytest.raises(InputError, match="has no 'colour'"):
        said("colour", Language.en)
    with pytest.raises(InputError, match="has no 'colour'"):
        labelled(pd.DataFrame({"colour": [1]}), Language.de)
