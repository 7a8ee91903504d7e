"""Plays one specification against a slugs binary and says in which way the two disagree.

The verdict and the bytes of strategies must be the oracle's with every combination of the two
flags; counterstrategies must be sound, and the translation must be the same game.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from random import Random
from typing import Literal

from children import ran
from oracle.automaton import Automaton, MalformedAutomatonError, from_json, to_json, to_text
from oracle.checker import check_counterstrategy, check_strategy
from oracle.fixpoint import Solution, extract, is_realizable, solve
from oracle.game import Game, build_game
from oracle.rendering import inputs_first, to_slugsin, to_structuredslugs
from oracle.slugsin import read_slugsin
from oracle.specification import Specification

Verdict = Literal["realizable", "unrealizable"]
ROBOTICS = "--sysInitRoboticsSemantics"
BIAS = "--biasForAction"
SECONDS = 300


@dataclass(frozen=True)
class Answer:
    """The answer of a binary: its verdict, if any, and its standard output."""

    verdict: Verdict | None
    output: str
    errors: str
    status: int


@dataclass
class Duel:
    """A binary, a folder for its files, and counts of what has been compared."""

    binary: Path
    folder: Path
    translations: float = 0.3  # the share of files whose translation is compared
    games: int = 0
    strategies: int = 0
    counterstrategies: int = 0

    def disagreement(self, specification: Specification, seed: int) -> str | None:
        """The first thing on which binary and oracle differ, in words; None if nothing."""
        return next(self._disagreements(specification, Random(seed)), None)

    def run(self, *arguments: str) -> Answer:
        """Run the binary on the file that was written last."""
        process = ran([self.binary, *arguments], timeout=SECONDS, cwd=self.folder)
        verdict: Verdict | None = None
        if "RESULT: Specification is realizable." in process.stderr:
            verdict = "realizable"
        elif "RESULT: Specification is unrealizable." in process.stderr:
            verdict = "unrealizable"
        return Answer(verdict, process.stdout, process.stderr, process.returncode)

    def counterstrategy(self, specification: Specification) -> Automaton:
        """The binary's own, of an unrealizable specification with its inputs first."""
        text = to_structuredslugs(specification, Random(0))
        (self.folder / "lost.structuredslugs").write_text(text)
        answer = self.run("--counterStrategy", "--jsonOutput", "lost.structuredslugs")
        return from_json(specification, answer.output)

    def _disagreements(self, specification: Specification, source: Random) -> Iterator[str]:
        self.games += 1
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
            told = [ROBOTICS] * robotics + [BIAS] * bias
            for difference in self._answer(game, solutions[bias], name, told, source):
                yield f"{' '.join([*told, name])}: {difference}\n{text}"
        if source.random() < self.translations:
            for difference in self._translation(game, name):
                yield f"--translate {name}: {difference}\n{text}"

    def _answer(
        self, game: Game, solution: Solution, name: str, told: list[str], source: Random
    ) -> Iterator[str]:
        robotics = ROBOTICS in told
        expected = is_realizable(game, solution.winning, robotics)
        answer = self.run("--explicitStrategy", "--jsonOutput", *told, name)
        if answer.verdict != ("realizable" if expected else "unrealizable"):
            yield f"should be {expected}, got {answer.verdict}, status {answer.status}\n" + (
                answer.errors
            )
            return
        if expected:
            yield from self._strategy(game, solution, name, told, answer.output, source)
        elif answer.output:
            yield f"a strategy for an unrealizable specification: {answer.output}"
        elif BIAS not in told:
            yield from self._counterstrategy(game, name, told)

    def _strategy(
        self,
        game: Game,
        solution: Solution,
        name: str,
        told: list[str],
        output: str,
        source: Random,
    ) -> Iterator[str]:
        self.strategies += 1
        specification = game.specification
        expected = extract(solution)
        text = to_json(specification, expected)
        if output != text:
            found = _parsed(specification, output)
            sound = found is not None and not check_strategy(game, found, ROBOTICS in told)
            kind = "sound but other" if sound else "wrong"
            yield f"{kind} strategy\n--- expected\n{text}\n--- found\n{output}"
        if source.random() < 0.5:
            plain = self.run("--explicitStrategy", *told, name).output
            if plain != to_text(specification, expected):
                yield f"wrong text form\n{plain}"

    def _counterstrategy(self, game: Game, name: str, told: list[str]) -> Iterator[str]:
        self.counterstrategies += 1
        answer = self.run("--counterStrategy", "--jsonOutput", *told, name)
        found = _parsed(game.specification, answer.output)
        if found is None:
            yield f"no counterstrategy: {answer.output}\n{answer.errors}"
            return
        complaints = check_counterstrategy(game, found, ROBOTICS in told)
        if complaints:
            yield f"unsound counterstrategy: {complaints}\n{answer.output}"

    def _translation(self, game: Game, name: str) -> Iterator[str]:
        answer = self.run("--translate", name)
        try:
            translated = build_game(read_slugsin(answer.output))
        except (ValueError, LookupError) as error:
            yield f"cannot be read ({error!r}): {answer.output}\n{answer.errors}"
            return
        if translated.specification.bits != game.specification.bits:
            yield f"has other variables: {answer.output}"
        elif _reachable_play(translated) != _reachable_play(game):
            yield f"is another game: {answer.output}"


def _parsed(specification: Specification, output: str) -> Automaton | None:
    try:
        return from_json(specification, output)
    except MalformedAutomatonError:
        return None


def _reachable_play(game: Game) -> list[object]:
    """What of a game matters; values outside their range may move as they like."""
    reachable = 0
    frontier = game.env_init & game.sys_init
    starts = [inputs for inputs in game.input_classes if inputs & game.env_init]
    play: list[object] = [frontier, starts]
    while frontier:
        state = (frontier & -frontier).bit_length() - 1
        reachable |= 1 << state
        moves = game.moves[state]
        after = 0
        for answers in moves.values():
            after |= answers
        goals = [g[state] & after for g in (*game.assumptions, *game.guarantees)]
        play.append((state, moves, goals))
        frontier = (frontier | after) & ~reachable
    return play
