"""Occasions and budgets of all joint searches.

    occasion                      search                         exhausted    budget spent
    a robot starves, stands in the way of a helper, or (live) all wait: (plan_search)
      all moves can be undone       to the next goal of each       the mission  few, later
      some remember                 for the mission, one round     forget it    last plan, row above
      some turn                     for the mission, one round     deadlock     last plan, next row
      some turn                     for the mission, more rounds   deadlock     few, later
    a plan moves no robot         to the goal of that robot      keep it      keep it
    a robot that waits follows    to the next goal of each       keep it      keep it
    1st, 6th, last spent search   few robots alone (deadlock)    deadlock     no verdict
    no strategy, though alone     for the mission               deadlock     no verdict
    a move with no way back       last plan again (rejoin),      refused      refused
                                  then for the mission

*few*: ``deadlock_of_few``; *later*: once the watch's patience is over again; *forget it*: the same
search for robots without the memory of their formulas. ``deadlock`` ends the run with the proof,
unless a robot is out of service (later). Robots cut off by one out of service have no goal. A round
is the three variants of ``search.Variant`` and one chain of legs. After ``MOST_FAILURES`` failures
in a row, or ``MOST_WORK`` in these, the run ends at ``search_limit``. Every plan is shortened
before it begins.
Budgets are states unless said otherwise; they were measured on random teams: small and often beats
large.
With a robot out of service on a floor where some turn, searches for the mission take one round with
the chain of a certificate, and fewer failures end the run.
"""

ROUNDS_FIRST = 4
"""Rounds of search for the first plan; every fourth failure adds one: after some further moves the
search is often easier, so each effort is made four times before a larger one."""
MOST_FAILURES = 24
MOST_FAILURES_HINDERED = 6
"""The same limit with a robot out of service, which no search can move: the run then ends without a
verdict."""
MOST_WORK = 1_000_000
"""Effort of searches in a row without success, in steps of one robot in a joint state: the run ends
at ``search_limit`` then. Some 220,000 a second were measured: about 5 s of the processor. No plan
of ``benchmarks/teams.py --bars``, with up to 50 robots, takes more than 31,000."""
LOOKS_FOR_FEW = (1, 6, MOST_FAILURES)
"""Numbers of exhausted searches after which a few robots are examined: the first, and occasionally
later ones."""
ROUNDS_AHEAD = 2
"""Rounds of the mission beyond those of the fastest robot: enough to serve all robots."""

FIRST_BUDGET = 200
"""Budget of each variant in the first two rounds; doubled from then on. A single deep search yields
plans of thousands of steps where 38 suffice."""
ROUNDS_OF_SEARCH = 7
MOST_FOR_AN_ORDER = 800
"""Budget of one random priority order: a good one needs few states, a bad one any number."""
SINGLES_BUDGET = 4_000
"""Budget of the breadth-first search of at most four robots, after the first round."""
PROOF_BUDGET = 60_000
"""Budget of this search as a proof: the joint states that an auditor enumerates again."""

LEG_BUDGET = 30
"""Budget of a leg, beyond two for each of its steps."""
CHAIN_BUDGET = 3_000
"""States examined without success until the first chain is given up; doubled with each round."""
LEGS_OF_A_ROBOT = 50
"""Above this average, robots only displace each other from their targets."""

FEW_SIZES = (2, 3)
FEW_GROUPS = 300
"""Number of groups of each size, the closest ones first."""
FEW_STATES = 20_000

CERTIFICATE_CHAIN = 1_000
CERTIFICATE = 1, 2_000, CERTIFICATE_CHAIN
"""Rounds, states and chain of the search for a certificate. A move without one is refused, and
may be tried again in the next tick. A chain as for a plan takes 5 s in a team of 20."""
CERTIFICATE_WORK = 600_000
"""Effort of certificates in a row without success, as of ``MOST_WORK``: after it, moves are refused
without a search until there is a joint plan."""
CERTIFICATES_KEPT = 10_000
REJOIN_PLACES = 3
"""Number of states of the last plan to which a return is tried: those with most robots in place."""

SHORTENING_ROUNDS = 3
SHORTENING_LAYERS = 20_000
"""Layers of the search for one robot's path: a tick and a number of steps each."""

REMEMBERED_STATES = 4_000
"""Poses with a formula's memory; with more, plans are made over poses alone."""

AT_ONCE = 0.02
"""Live: seconds within which most searches end; results of others are fetched later."""
LONGEST = 60
"""Live: the most steps, all undoable, that robots take during a search; then they wait."""
