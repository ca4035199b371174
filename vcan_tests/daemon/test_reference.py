"""The pages made from tables: whole, and what is special about each."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from canhelm.errors import all_errors
from daemon.cli.main import COMMANDS
from daemon.reference.completions import completions
from daemon.reference.man import man_pages
from daemon.reference.markdown import table
from daemon.reference.pages import site_pages
from daemon.reference.sentences import Sentence, sentences
from drivers.canopen.codes import SDO_ABORTS
from drivers.encoder.objects import OBJECTS as ENCODER_OBJECTS
from drivers.epos.codes import EMERGENCIES
from drivers.epos.objects import OBJECTS as EPOS_OBJECTS
from profiles.json_schema import json_schema

NAMES = [name for commands in COMMANDS.values() for name in commands]


@pytest.fixture(scope="module")
def pages() -> dict[str, str]:
    return site_pages()


@pytest.fixture(scope="module")
def manual() -> dict[str, str]:
    return man_pages()


# -- pages of the site ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_every_command_has_a_section(pages: dict[str, str], name: str) -> None:
    assert f"\n### canhelm {name}\n" in pages["commands.md"]


def test_usage_is_that_of_the_installed_command(pages: dict[str, str]) -> None:
    assert "\ncanhelm motor velocity [OPTIONS] NODE VALUE\n" in pages["commands.md"]


@pytest.mark.parametrize("known", [EPOS_OBJECTS, ENCODER_OBJECTS], ids=["epos", "encoder"])
def test_every_object_has_a_row(pages: dict[str, str], known: object) -> None:
    assert isinstance(known, type(EPOS_OBJECTS))
    rows = re.findall(r"^\| `(\S+)` \| `(\S+)` \|", pages["objects.md"], re.MULTILINE)
    assert {(entry.address, entry.name) for entry in known.objects} <= set(rows)


def test_every_code_of_a_device_has_a_row(pages: dict[str, str]) -> None:
    codes = [f"| `0x{code:04X}` |" for code in EMERGENCIES] + [f"| `0x{code:08X}` |" for code in SDO_ABORTS]
    assert [code for code in codes if code not in pages["errors.md"]] == []


def test_every_error_has_its_exit_code(pages: dict[str, str]) -> None:
    rows = [f"| `{leaf.__name__}` | {leaf.exit_code} | {leaf.rpc_code} |" for leaf in all_errors()]
    assert [row for row in rows if row not in pages["errors.md"]] == []


def test_every_key_of_a_profile_has_a_row(pages: dict[str, str]) -> None:
    sections = dict(re.findall(r"^## (\w+)\n(.*?)(?=^## |\Z)", pages["profile.md"], re.MULTILINE | re.DOTALL))
    mappings = json_schema()["$defs"]
    keys = [(name, key) for name, mapping in mappings.items() for key in mapping["properties"] if key != "extends"]
    assert [each for each in keys if f"| `{each[1]}` |" not in sections[each[0]]] == []


def test_a_mapping_within_a_mapping_is_a_link(pages: dict[str, str]) -> None:
    assert "| `motor` | [Motor](#motor) |" in pages["profile.md"]


def test_every_row_of_a_page_has_as_many_cells_as_its_head(pages: dict[str, str]) -> None:
    for text in pages.values():
        for block in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
            assert len({len(re.findall(r"(?<!\\)\|", line)) for line in block.splitlines()}) == 1


def test_what_separates_cells_or_begins_html_is_escaped() -> None:
    assert table(["a"], [["b|c\n<d>"]]).splitlines()[2] == r"| b\|c &lt;d> |"


# -- sentences --------------------------------------------------------------------------------------------------------


def test_a_sentence_of_the_source_is_found_with_its_remedy() -> None:
    wanted = Sentence("UsageError", "node id {node} is out of range", "give 1 to 127")
    assert wanted in sentences()


def test_a_sentence_names_what_is_put_in() -> None:
    assert Sentence("PermissionRefused", "{folder} belongs to somebody else", "choose a place with {option} PATH") in (
        sentences()
    )


# -- man pages and completions ----------------------------------------------------------------------------------------


def test_every_command_has_a_man_page(manual: dict[str, str]) -> None:
    assert set(manual) == {"canhelm.1", *(f"canhelm-{name}.1" for name in NAMES)}


def test_a_man_page_has_its_name_where_apropos_looks(manual: dict[str, str]) -> None:
    assert ".SH NAME\ncanhelm\\-drive \\- Drive the vehicle\n" in manual["canhelm-drive.1"]


def test_a_man_page_has_usage_and_options_of_its_words(manual: dict[str, str]) -> None:
    page = manual["canhelm-drive.1"]
    assert ".SH CANHELM DRIVE TO\n.B canhelm drive to " in page
    assert "\n.TP\n\\fB\\-\\-published\\fR\n" in page


@pytest.mark.parametrize("code", [0, 1, 2, 3, 4, 5, 6, 7, 130])
def test_the_first_man_page_has_the_exit_codes(manual: dict[str, str], code: int) -> None:
    assert f"\n.TP\n.B {code}\n" in manual["canhelm.1"]


def test_no_markdown_is_left_in_a_man_page(manual: dict[str, str]) -> None:
    left = re.compile(r"`|\*\*|^#|\]\(", re.MULTILINE)
    assert [name for name, text in manual.items() if left.search(text)] == []


def test_no_line_of_text_is_taken_for_a_request(manual: dict[str, str]) -> None:
    requests = {
        line.split()[0] for text in manual.values() for line in text.splitlines() if line.startswith((".", "'"))
    }
    assert requests == {".TH", ".SH", ".PP", ".TP", ".B", ".BR"}


@pytest.fixture(scope="module")
def scripts() -> dict[str, str]:
    return completions()


def test_the_completions_are_there_under_the_names_that_shells_look_for(scripts: dict[str, str]) -> None:
    assert {name: "velocity" in text for name, text in scripts.items()} == {
        "canhelm": True,
        "_canhelm": True,
        "canhelm.fish": True,
    }


def test_the_shell_can_read_its_completions(scripts: dict[str, str]) -> None:
    checked = subprocess.run(["bash", "-n"], input=scripts["canhelm"], capture_output=True, text=True)
    assert (checked.returncode, checked.stderr) == (0, "")


def test_the_tab_key_needs_no_program(scripts: dict[str, str]) -> None:
    tab = 'COMP_WORDS=(canhelm motor vel); COMP_CWORD=2; _canhelm; echo "${COMPREPLY[@]}"'
    typed = subprocess.run(
        ["bash", "--norc"], input=f"PATH=\n{scripts['canhelm']}\n{tab}\n", capture_output=True, text=True
    )
    assert (typed.stdout, typed.stderr) == ("velocity\n", "")


# -- writing ----------------------------------------------------------------------------------------------------------


def test_the_module_writes_what_is_asked_for_into_a_folder(tmp_path: Path) -> None:
    folder = tmp_path / "made" / "man1"
    subprocess.run([sys.executable, "-m", "daemon.reference", "man", str(folder)], check=True)
    written = (folder / "canhelm-motor.1").read_text(encoding="utf-8")
    assert ".B canhelm motor velocity [OPTIONS] NODE VALUE\n" in written


def test_another_word_is_wrong_usage() -> None:
    done = subprocess.run([sys.executable, "-m", "daemon.reference", "pictures"], capture_output=True, text=True)
    assert (done.returncode, "pages|man|completions DIR" in done.stderr) == (2, True)
