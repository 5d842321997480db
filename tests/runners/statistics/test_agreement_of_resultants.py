"""Resultants by every engine: AS-504's by CVODES, sweep, covariance equation and 20,000 simulated flights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lag import lag
from planes import in_both

import ascentwind as aw
from ascentwind.runners.statistics.agreement import FALSE_ALARM, Agreement
from ascentwind.runners.statistics.agreement_of_resultants import ResultantAgreement, resultant_agreement

FLIGHTS = aw.Ensemble(runs=20_000, seed=504, confidence=0.99)
TIMES = [60.0, 75.0]


@pytest.fixture(scope="module")
def flown() -> list[ResultantAgreement]:
    study = aw.Study.from_vehicle(in_both())
    engines = {"sweep": aw.Sweep.tight(), "covariance": aw.CovarianceEquation.tight()}
    statistics = {name: study.response_statistics(TIMES, engine=engine) for name, engine in engines.items()}
    found = [resultant_agreement(study, TIMES, statistics, FLIGHTS, p) for p in (0.05, 0.00135)]
    return [each for each in found if each is not None]


@pytest.mark.slow
def test_engines_agree_and_flights_pass_levels_as_often_as_they_should(flown):
    assert len(flown) == 2
    for found in flown:
        assert set(found.differences) == {"sweep", "covariance"}
        for apart in found.differences.values():
            assert apart.max() < 1e-6
        assert found.inside.all()
        low, high = found.interval
        assert low < found.flights * found.probability < high
        assert not found.impossible(FALSE_ALARM).any()


@pytest.mark.slow
def test_what_disagrees_is_told(flown):
    right = flown[0]
    nothing = np.zeros((2, 1, 1), bool)
    complaints = Agreement({}, {}, {}, ~nothing, ~nothing, nothing, right).complaints()
    assert complaints == []
    wrong = replace(right, differences={"sweep": right.differences["sweep"] + 2e-6})
    (text,) = Agreement({}, {}, {}, ~nothing, ~nothing, nothing, wrong).complaints()
    assert "by sweep differs" in text
    rare = replace(right, level=1.05 * right.level, passed=right.passed // 2)
    (text,) = Agreement({}, {}, {}, ~nothing, ~nothing, nothing, rare).complaints()
    assert "20000 simulated flights pass the level" in text


def test_one_plane_has_no_resultants():
    assert resultant_agreement(lag(), [1.0], {}, FLIGHTS) is None
