"""The collocation by sparse elimination against LAPACK, its duality, and the compiled functions at nodes."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from ascentwind.codegen.nodes.compiled import node_functions
from ascentwind.codegen.nodes.matrix import NodeMatrix
from ascentwind.codegen.sweep.gauss_legendre import STAGES, TABLEAU
from ascentwind.model import define_system
from ascentwind.runners import Cvodes
from ascentwind.runners.solvers.collocation import Collocation, CompiledCollocation
from ascentwind.runners.solvers.collocation_grid import Grid
from ascentwind.runners.study import Study


@pytest.fixture(scope="module")
def library(cache):
    t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))
    system = define_system("any", time=t, states={"x": (x, -x + n)}, noises={"n": n}, outputs={"x": x})
    path = node_functions(system).shared_library
    assert path is not None
    return path


def at_nodes(dense: np.ndarray) -> NodeMatrix:
    """Matrices (k, stages, n, n) with the pattern of their nonzeros."""
    flat = dense.reshape(-1, *dense.shape[2:])
    pattern = ca.sparsify(ca.DM((np.abs(flat).max(axis=0) > 0).astype(float))).sparsity()
    return NodeMatrix(pattern, flat[:, pattern.row(), pattern.get_col()])


@pytest.mark.parametrize("keep", [False, True])
def test_sparse_elimination_is_that_by_lapack(library, keep):
    """Random stable matrices, with forcing, forward and backward; and the duality of both.

    The last two states do not act on themselves, so that their pivots are the unit matrix; one of them by nothing else.
    """
    random = np.random.default_rng(504)
    edges = np.cumsum(np.append(0.0, random.uniform(0.01, 0.1, 21)))
    A = random.standard_normal((21, STAGES, 9, 9)) * (random.random((9, 9)) < 0.3) - 2 * np.eye(9)
    A[:, :, 7:, 7:] = 0.0
    A[:, :, 7, :7], A[:, :, 7, 2] = 0.0, 1.0
    x, a, f, g = *random.standard_normal((2, 9)), *random.standard_normal((2, 21, STAGES, 9))
    grid, matrices = Grid(edges), at_nodes(A)
    assert matrices.pattern.nnz() < 50
    np.testing.assert_array_equal(matrices.dense.reshape(A.shape), A)
    compiled, reference = CompiledCollocation(grid, matrices, library, keep), Collocation(grid, matrices)
    for one, other in zip(compiled.forward(x, f), reference.forward(x, f), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-13)
    for one, other in zip(compiled.backward(a, g[:13]), reference.backward(a, g[:13]), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-13)
    stages, along = compiled.forward(x, f)
    adjoints, back = compiled.backward(a, g)
    weights = grid.weights[..., None]
    # a'x at both ends differs by the integral of a'f - x'g, exactly, as the method is symplectic
    duality = np.sum(weights * (adjoints * f - stages * g))
    assert a @ along[-1] - back[0] @ x == pytest.approx(duality, abs=1e-12)


def test_order_eight(library):
    """A constant matrix, by the exponential: half the step, 1 / 256 of the error."""
    A = np.array([[0.0, 1.0], [-4.0, -0.1]])
    start, errors = np.array([1.0, 0.0]), []
    roots, vectors = np.linalg.eig(A)
    exact = (vectors @ np.diag(np.exp(3.0 * roots)) @ np.linalg.inv(vectors)).real @ start
    for steps in (3, 6):
        grid, matrices = Grid(np.linspace(0, 3, steps + 1)), at_nodes(np.tile(A, (steps, STAGES, 1, 1)))
        _, along = CompiledCollocation(grid, matrices, library).forward(start, np.zeros((steps, STAGES, 2)))
        errors.append(np.abs(along[-1] - exact).max())
    assert 200 < errors[0] / errors[1] < 320


def test_short_steps_lose_no_digits(library):
    """exp(-a t) by 20,000 steps: X - x has few digits there, and what a step loses, the next ones lose as well."""
    rate, steps = 0.8, 20_000
    grid, matrices = Grid(np.linspace(0.0, 1.0, steps + 1)), at_nodes(np.full((steps, STAGES, 1, 1), -rate))
    ours, none = CompiledCollocation(grid, matrices, library), np.zeros((steps, STAGES, 1))
    for edge in (ours.forward(np.ones(1), none)[1][-1], ours.backward(np.ones(1), none)[1][0]):
        assert edge == pytest.approx(np.exp(-rate), rel=1e-13)


@pytest.mark.parametrize("keep", [False, True])
def test_a_pivot_that_vanishes_is_left_to_lapack(library, keep, caplog):
    """With roots 1 / (h b) of two states by themselves, b of the tableau, I - h a A is singular in these two."""
    values = np.linalg.eigvals(TABLEAU)
    root = 1 / values[np.argmax(values.imag)]
    A = np.zeros((3, 3))
    A[:2, :2] = [[root.real, -root.imag], [root.imag, root.real]]
    A[0, 2] = A[2, 0] = A[2, 1] = 1.0
    grid, matrices = Grid(np.array([0.0, 1.0])), at_nodes(np.tile(A, (1, STAGES, 1, 1)))
    x, f = np.array([1.0, 2.0, 3.0]), np.ones((1, STAGES, 3))
    ours, reference = CompiledCollocation(grid, matrices, library, keep), Collocation(grid, matrices)
    with caplog.at_level("INFO"):
        for one, other in (
            (ours.forward(x, f), reference.forward(x, f)),
            (ours.backward(x, f), reference.backward(x, f)),
        ):
            np.testing.assert_array_equal(one[0], other[0])
            np.testing.assert_array_equal(one[1], other[1])
    assert "LAPACK" in caplog.text


def test_no_state_acts_on_another(library):
    """A = 0: nothing to eliminate, x grows by the integral of its forcing."""
    grid, matrices = Grid(np.array([0.0, 0.5, 2.0])), at_nodes(np.zeros((2, STAGES, 2, 2)))
    _, along = CompiledCollocation(grid, matrices, library).forward(np.array([1.0, 0.0]), np.ones((2, STAGES, 2)))
    np.testing.assert_allclose(along, [[1.0, 0.0], [1.5, 0.5], [3.0, 2.0]], rtol=1e-14)


def test_compiled_and_interpreted_agree(as504):
    random = np.random.default_rng(504)
    system, p = as504.system, as504.executable.parameters
    compiled, interpreted = node_functions(system), node_functions(system, False)
    assert compiled.shared_library is not None
    t, v = np.array([40.0, 75.0, 120.0]), np.array([list(as504.tables(x).values()) for x in (40.0, 75.0, 120.0)])
    z, w = compiled.numbers(p), random.random(3)
    a, x = random.standard_normal((2, 3, len(system.states)))
    c, m = random.standard_normal((3, len(system.outputs))), random.standard_normal(len(system.noises))
    for name, arguments in (("quadratic_gradient", (a, x, c, m)), ("linear_gradient", (a, x, c))):
        ours, reference = (getattr(f, name)(w, t, v, z, *arguments) for f in (compiled, interpreted))
        for one, other in zip(ours, reference, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-10, atol=1e-12 * np.abs(other).max())
    matrices = as504.matrices(75.0)
    for name, expected in zip("ABC", matrices[:3], strict=True):
        np.testing.assert_allclose(compiled.matrices(t, v, z)[name].dense[1], expected, rtol=1e-12, atol=1e-300)


@pytest.mark.parametrize("scale", [1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6])
@pytest.mark.parametrize("second", [1.0, 0.05])
def test_a_system_in_any_unit_of_time(scale, second):
    """Two lags, tau and ``second`` tau, in series, to 3 tau, whose unit of time is a nanosecond or a fortnight.

    White noise into the first, x' = -x / tau + n / sqrt(tau): variances and derivatives with respect to ln(tau) are
    functions of t2 / tau alone. That of the first is (1 - e^(-2 t2 / tau)) / 2.
    """
    t, x, y, n, tau = (ca.SX.sym(name) for name in ("t", "x", "y", "n", "tau"))

    def study(end: float, value: float) -> Study:
        system = define_system(
            "lags",
            time=t,
            states={"x": (x, -x / tau + n / ca.sqrt(tau)), "y": (y, (x - y) / (second * tau))},
            noises={"n": n},
            outputs={"x": x, "y": y},
            parameters={"tau": (tau, value)},
            end=end,
        )
        return Study.from_system(system)

    here = study(4 * scale, scale)
    first = here.sensitivity("x", 3 * scale, quantity="variance")
    assert first.attrs["variance"] == pytest.approx(0.5 * (1 - np.exp(-6)), rel=1e-8)
    assert first["derivative"].item() * scale == pytest.approx(-3 * np.exp(-6), rel=1e-7)
    own, reference = (
        s.sensitivity("y", 3 * u, quantity="variance") for s, u in ((here, scale), (study(4.0, 1.0), 1.0))
    )
    assert own.attrs["variance"] == pytest.approx(reference.attrs["variance"], rel=1e-9)
    by_cvodes = here.response_statistics([3 * scale], engine=Cvodes(relative_tolerance=1e-10))
    assert own.attrs["variance"] == pytest.approx(by_cvodes.variance.sel(response="y").values[0, 0], rel=1e-7)
    assert own["derivative"].item() * scale == pytest.approx(reference["derivative"].item(), rel=1e-7)
    peak = here.sensitivity("y", "peak", quantity="variance")
    assert peak.attrs["t2_s"] == pytest.approx(4 * scale, rel=1e-12)
