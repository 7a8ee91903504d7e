"""Scenarios: the data model, the catalogue of robots and obstacles, and the YAML loader."""

from safenav.scenario.catalogue import Catalogue, built_in
from safenav.scenario.loader import load_scenario, load_scenario_text
from safenav.scenario.model import (
    Coordination,
    Expect,
    Limits,
    Obstacle,
    ObstacleType,
    Outcome,
    ResolveAt,
    Robot,
    RobotModel,
    Scenario,
    Timing,
    Tracking,
    Until,
)
from safenav.scenario.objective import Cover, Hold, Ltl, Objective, Patrol, Target, Visit
from safenav.scenario.schema import schema_text

__all__ = [
    "Catalogue",
    "Coordination",
    "Cover",
    "Expect",
    "Hold",
    "Limits",
    "Ltl",
    "Objective",
    "Obstacle",
    "ObstacleType",
    "Outcome",
    "Patrol",
    "ResolveAt",
    "Robot",
    "RobotModel",
    "Scenario",
    "Target",
    "Timing",
    "Tracking",
    "Until",
    "Visit",
    "built_in",
    "load_scenario",
    "load_scenario_text",
    "schema_text",
]
