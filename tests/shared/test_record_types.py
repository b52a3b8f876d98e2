"""The types of the records say what the records are: the same fields, the same ones left out."""

import ast
import importlib

import pytest
from places import ROOT

from shared.record import Record

STUB = (ROOT / "shared" / "records.pyi").read_text(encoding="utf-8")
TYPED = {node.name: node for node in ast.parse(STUB).body if isinstance(node, ast.ClassDef)}
MAKERS = ("arm_description", "job", "job_header", "job_log", "job_messages", "messages")


def made():
    """The records of the modules that the stub names, by name."""
    found = {}
    for maker in MAKERS:
        for name, kind in vars(importlib.import_module("shared." + maker)).items():
            if isinstance(kind, type) and issubclass(kind, Record):
                found[name] = kind
    return found


RECORDS = made()


def test_each_record_has_its_types():
    assert sorted(TYPED) == sorted(RECORDS)


@pytest.mark.parametrize("name", sorted(TYPED))
def test_the_types_have_the_fields_of_the_record(name):
    fields = TYPED[name].body
    assert tuple(field.target.id for field in fields) == RECORDS[name]._fields
    left_out = len([field for field in fields if field.value is not None])
    assert left_out == len(RECORDS[name].__new__.__defaults__)
