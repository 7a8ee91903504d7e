# The public names and their modules: what type checkers read, and __init__.py at run time.
from safenav.run.checked import check_trace as check_trace
from safenav.run.reading import read_run as read_run
from safenav.runtime.run.checkpoint import resumption as resumption
from safenav.runtime.run.mission import Mission as Mission
from safenav.runtime.run.mission import RunResult as RunResult
from safenav.runtime.worlds.protocol import Acted as Acted
from safenav.runtime.worlds.protocol import Arrived as Arrived
from safenav.runtime.worlds.protocol import Blocked as Blocked
from safenav.runtime.worlds.protocol import BlockingWorld as BlockingWorld
from safenav.runtime.worlds.protocol import Elsewhere as Elsewhere
from safenav.runtime.worlds.protocol import Failed as Failed
from safenav.runtime.worlds.protocol import Lost as Lost
from safenav.runtime.worlds.protocol import Sensed as Sensed
from safenav.runtime.worlds.protocol import World as World
from safenav.runtime.worlds.protocol import WorldEvent as WorldEvent
from safenav.scenario.model import Need as Need
from safenav.scenario.model import Obstacle as Obstacle
from safenav.scenario.model import ObstacleType as ObstacleType
from safenav.scenario.model import ResolveAt as ResolveAt
from safenav.scenario.model import Robot as Robot
from safenav.scenario.model import Scenario as Scenario
from safenav.scenario.reading.catalogue import built_in as built_in
from safenav.scenario.reading.loader import load_scenario as load_scenario
from safenav.spec.compile import compile_task as compile_task
from safenav.spec.task import Task as Task
from safenav.studio.server import LiveView as LiveView
from safenav.synthesis.slugs import Synthesizer as Synthesizer
from safenav.trace.file import TraceWriter as TraceWriter
from safenav.trace.file import read_trace as read_trace
from safenav.trace.vocabulary import ActResult as ActResult
from safenav.verify.verification import first_failure as first_failure
from safenav.world.map import Heading as Heading
from safenav.world.poses import Pose as Pose

__version__: str
__all__: list[str]
