"""The matrices of a system at one time after another, without a conversion of arguments at every call."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .covariance import Rate, compiled_rate, interpreted_derivative
from .executable import ExecutableSystem
from .functions import MATRICES


class MatrixEvaluator:
    """Evaluates chosen matrices of a system in buffers of its own; one evaluator serves one thread.

    Parameters
    ----------
    executable : ExecutableSystem
    names : tuple of str
        Some of A, B, C, D, E, G and inputs, in the order in which a call returns them.
    """

    def __init__(self, executable: ExecutableSystem, names: tuple[str, ...]):
        function = executable.functions.matrices
        self._executable = executable  # keeps alive the tables that are read by address
        self._buffer, self._evaluate = function.buffer()
        self._time, self._low, self._high = np.zeros(1), np.zeros(1), np.zeros(1)
        parameters = np.ascontiguousarray(executable.parameters, dtype=float)
        self._arguments = (self._time, self._low, self._high, parameters, np.array([executable.address]))
        for i, argument in enumerate(self._arguments):
            self._buffer.set_arg(i, argument.data)  # pyright: ignore[reportCallIssue]
        self._nonzeros = [np.zeros(max(1, function.nnz_out(i))) for i in range(len(MATRICES))]
        for i, nonzeros in enumerate(self._nonzeros):
            self._buffer.set_res(i, nonzeros.data)  # pyright: ignore[reportCallIssue]
        self._wanted = []
        for name in names:
            i = MATRICES.index(name)
            sparsity = function.sparsity_out(i)
            rows, columns = np.array(sparsity.row(), dtype=int), np.array(sparsity.get_col(), dtype=int)
            self._wanted.append((sparsity.shape, rows * sparsity.size2() + columns, self._nonzeros[i][: rows.size]))

    def __call__(self, time: float, low: float, high: float) -> list[NDArray[np.float64]]:
        """Return the matrices at a time (s), dense, tables looked up within [low, high]."""
        self._time[0], self._low[0], self._high[0] = time, low, high
        self._evaluate()
        found = []
        for (rows, columns), places, nonzeros in self._wanted:
            matrix = np.zeros(rows * columns)
            matrix[places] = nonzeros
            found.append(matrix.reshape(rows, columns))
        return found


def covariance_rate(executable: ExecutableSystem) -> Rate:
    """Return (time, low, high, y) -> dy/dt of the covariance equation; it serves one thread.

    In C where the system is compiled, by NumPy elsewhere.
    """
    if executable.shared_library is not None:
        return compiled_rate(executable.system, executable.shared_library, executable.parameters, executable.tables)
    matrices = MatrixEvaluator(executable, ("A", "B", "E", "inputs"))
    derivative = interpreted_derivative(executable.system)

    def rate(time: float, low: float, high: float, y: NDArray) -> NDArray:
        A, B, E, inputs = matrices(time, low, high)
        return derivative(A, B, E @ inputs[:, 0], y)

    return rate
