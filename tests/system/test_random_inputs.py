"""Slices of `benchmarks/fuzz.py`: mutated files of every kind, and mutated command lines over mutated files."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fuzzing import candidates, commands, files, imports, plans, targets, wishes

from velatura import cli


def test_any_file_is_refused_in_one_line_or_read_back_equal() -> None:
    rng = np.random.default_rng(5)
    assert not [failure for _ in range(100) for failure in files.trial(rng)]


def test_any_file_of_other_programs_is_refused_in_one_line_or_read_back_equal() -> None:
    rng = np.random.default_rng(8)
    assert not [failure for _ in range(80) for failure in imports.trial(rng)]


def test_any_plan_is_refused_in_one_line_or_has_points() -> None:
    assert not [failure for i in (39, *range(60)) for failure in plans.trial(np.random.default_rng((0, *b"plans", i)))]


def test_any_candidate_of_the_benchmark_is_refused_in_one_line_or_scored() -> None:
    rng = np.random.default_rng(4)
    assert not [failure for _ in range(150) for failure in candidates.trial(rng)]


def test_any_target_is_refused_in_one_line_or_read_back_equal() -> None:
    rng = np.random.default_rng(2)
    cases = [targets.mutated(rng) for _ in range(100)]
    assert not [failure for case in cases for failure in targets.tried(case)]


def test_any_target_has_stacks_or_a_reason() -> None:
    rng = np.random.default_rng(3)
    cases = [targets.mutated(rng) for _ in range(6)]
    assert not [failure for case in cases for failure in targets.tried(case, "bati2021")]


def test_any_command_line_ends_in_one_line_and_loses_nothing() -> None:
    """No traceback, exit status 0 to 3; nothing is written on refusal, and no file that was there is changed."""
    rng = np.random.default_rng(1)
    assert not [failure for _ in range(10) for failure in commands.trial(rng)]


@pytest.mark.parametrize("verb", wishes.WISHES)
def test_any_wish_ends_in_an_answer_or_one_line(verb: str) -> None:
    """As command lines do."""
    rng = np.random.default_rng(1)
    assert not [failure for _ in range(2) for failure in wishes.tried(verb, rng)]


def test_a_command_line_that_takes_too_long_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def endless(*arguments: Any, **options: Any) -> None:
        while True:
            pass

    monkeypatch.setattr(commands, "LIMIT_S", 0.2)
    monkeypatch.setattr(cli, "app", endless)
    (failure,) = commands.tried(["presets"], commands.INPUTS)
    assert failure.kind == "traceback" and "not done" in failure.detail
