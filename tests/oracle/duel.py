"""Plays one specification against a slugs binary and says in which way the two disagree.

The verdict and the bytes of strategies must be the oracle's with every combination of the two
flags; counterstrategies must be sound, and the translation must be the same game.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from random import Random
from subprocess import CompletedProcess

from children import ran
from oracle.automata import (
    Automaton,
    check_counterstrategy,
    check_strategy,
    from_json,
    to_json,
    to_text,
)
from oracle.game import Game, Solution, build_game, extract, solve
from oracle.specification import Specification
from oracle.text import inputs_first, read_slugsin, to_slugsin, to_structuredslugs

ROBOTICS = "--sysInitRoboticsSemantics"
BIAS = "--biasForAction"
SECONDS = 300


def verdict(errors: str) -> str | None:
    """The verdict in what a binary has written on standard error."""
    for word in ("unrealizable", "realizable"):
        if f"RESULT: Specification is {word}." in errors:
            return word
    return None


@dataclass
class Duel:
    """A binary, a folder for its files, and counts of what has been compared. ``other``: another
    build of it, which must say the same."""

    binary: Path
    folder: Path
    other: Path | None = None
    translations: float = 0.3  # the share of files whose translation is compared
    strategies: int = 0
    counterstrategies: int = 0

    def disagreement(self, specification: Specification, seed: int) -> str | None:
        """The first thing on which binary and oracle differ, in words; None if nothing."""
        return next(self._disagreements(specification, Random(seed)), None)

    def run(self, *arguments: str) -> CompletedProcess[str]:
        """Run the binary on the file that was written last."""
        builds = filter(None, (self.binary, self.other))
        one, *more = (ran([b, *arguments], timeout=SECONDS, cwd=self.folder) for b in builds)
        for each in more:
            assert (each.returncode, each.stdout) == (one.returncode, one.stdout), each.stderr
        return one

    def counterstrategy(self, specification: Specification) -> Automaton:
        """The binary's own, of an unrealizable specification with its inputs first."""
        text = to_structuredslugs(specification, Random(0))
        (self.folder / "lost.structuredslugs").write_text(text)
        answer = self.run("--counterStrategy", "--jsonOutput", "lost.structuredslugs")
        return from_json(specification, answer.stdout)

    def _disagreements(self, specification: Specification, source: Random) -> Iterator[str]:
        flags = list(product((False, True), (False, True)))
        if specification.is_boolean():
            text = to_slugsin(specification, source)
            yield from self._play(specification, text, "game.slugsin", flags, source)
            flags = [flags[0], source.choice(flags[1:])]
        ordered = inputs_first(specification)
        text = to_structuredslugs(ordered, source)
        yield from self._play(ordered, text, "game.structuredslugs", flags, source)

    def _play(
        self,
        specification: Specification,
        text: str,
        name: str,
        flags: list[tuple[bool, bool]],
        source: Random,
    ) -> Iterator[str]:
        (self.folder / name).write_text(text)
        game = build_game(specification)
        solutions = {bias: solve(game, bias) for bias in {bias for _, bias in flags}}
        for robotics, bias in flags:
            options = [ROBOTICS] * robotics + [BIAS] * bias + [name]
            if solutions[bias].realizable(robotics):
                found = self._strategy(specification, solutions[bias], options, source)
            else:
                found = self._counterstrategy(specification, game, options)
            for difference in found:
                yield f"{' '.join(options)}: {difference}\n{text}"
        if source.random() < self.translations:
            answer = self.run("--translate", name)
            try:
                translated = read_slugsin(answer.stdout)
                same = translated.bits == specification.bits
                if not same or reachable_play(build_game(translated)) != reachable_play(game):
                    yield f"--translate {name}: is another game: {answer.stdout}\n{text}"
            except (ValueError, LookupError) as error:
                yield f"--translate {name}: {error!r}: {answer.stdout}\n{answer.stderr}\n{text}"

    def _strategy(
        self, specification: Specification, solution: Solution, options: list[str], source: Random
    ) -> Iterator[str]:
        self.strategies += 1
        answer = self.run("--explicitStrategy", "--jsonOutput", *options)
        if verdict(answer.stderr) != "realizable":
            yield f"is realizable; status {answer.returncode}\n{answer.stderr}"
            return
        expected = extract(solution)
        if answer.stdout != to_json(expected):
            sound, game = False, solution.game
            if (found := _parsed(specification, answer.stdout)) is not None:
                sound = not check_strategy(game, found, ROBOTICS in options)
            kind = "sound but other" if sound else "wrong"
            yield f"{kind} strategy\n{to_json(expected)}\n--- found\n{answer.stdout}"
        if source.random() < 0.5:
            plain = self.run("--explicitStrategy", *options).stdout
            if plain != to_text(expected):
                yield f"wrong text form\n{plain}"

    def _counterstrategy(
        self, specification: Specification, game: Game, options: list[str]
    ) -> Iterator[str]:
        answer = self.run("--explicitStrategy", "--jsonOutput", *options)
        if verdict(answer.stderr) != "unrealizable" or answer.stdout:
            yield f"is unrealizable; status {answer.returncode}\n{answer.stderr}{answer.stdout}"
        elif BIAS not in options:
            self.counterstrategies += 1
            answer = self.run("--counterStrategy", "--jsonOutput", *options)
            found = _parsed(specification, answer.stdout)
            if found is None:
                yield f"no counterstrategy: {answer.stdout}\n{answer.stderr}"
            elif complaints := check_counterstrategy(game, found, ROBOTICS in options):
                yield f"unsound counterstrategy: {complaints}\n{answer.stdout}"


def _parsed(specification: Specification, output: str) -> Automaton | None:
    try:
        return from_json(specification, output)
    except (ValueError, LookupError, TypeError):
        return None


def reachable_play(game: Game) -> list[bytes]:
    """What of a game matters; values outside their range may move as they like."""
    starts = game.env_init & game.sys_init
    moves = game.env[:, :, None] & game.sys
    reached, before = starts, None
    while before is None or (reached != before).any():
        before, reached = reached, reached.copy()
        reached[game.successors[moves[before].any(0)]] = True
    goals = [moves & goal for goal in (*game.assumptions, *game.guarantees)]
    matter = (each[reached] for each in (game.env, moves, *goals))
    every = (starts, game.inputs_of(game.env_init), reached, *matter)
    return [each.tobytes() for each in every]
