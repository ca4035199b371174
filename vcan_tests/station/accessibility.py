"""What axe-core finds on a page: the checker runs inside it, from a file of this machine."""

from __future__ import annotations

from importlib.resources import files
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from playwright.sync_api import Page

RUN = """async only => {
    const rules = only.length ? {runOnly: only} : {rules: {"target-size": {enabled: true}}};
    const found = await axe.run(document, {resultTypes: ["violations"], ...rules});
    return found.violations.flatMap(rule => rule.nodes.map(node => `${rule.id}: ${node.target.join(" ")}: ` +
        [...node.any, ...node.all, ...node.none].map(check => check.message).join("; ")));
}"""


def findings(page: Page, *only: str) -> list[str]:
    """What is wrong for people with a screen reader, without colours, without a mouse; each with its element.

    Args:
        page: that is looked at.
        only: rules of axe-core; all where none is named.
    """
    if not page.evaluate("() => 'axe' in window"):
        page.evaluate(files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8"))
    found: list[str] = page.evaluate(RUN, only)
    return found
