"""Templates of scenarios."""

from pathlib import Path

TEMPLATES = {
    "minimal": "one robot that goes back and forth",
    "door": "a flying robot, a walking one, and a closed door that they discover",
    "team": "three robots on one floor, with models and an obstacle type of their own",
}
"""The purposes of the templates, whose texts are beside this module."""

DEFAULT = "door"


def template_text(name: str) -> str:
    """Return the YAML of a template."""
    folder = Path(__file__).with_name("templates")
    return (folder / f"{name}.yaml").read_text(encoding="utf-8")
