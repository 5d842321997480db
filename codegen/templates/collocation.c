/* ---- Collocation with three stages: k steps of n states, unknowns ordered state by state, stages within. ----
 *
 * N = I - h A (a x I) is the matrix of the stage derivatives. The tableau holds a by rows, then b.
 * Rows of A are mostly zero, and so are those of N: multipliers that are zero are skipped.
 */

static int factorise_step(long m, double *restrict N, int *restrict pivot) {
  long i, j, p;
  for (p = 0; p < m; ++p) {
    long largest = p;
    for (i = p + 1; i < m; ++i)
      if (fabs(N[i * m + p]) > fabs(N[largest * m + p])) largest = i;
    pivot[p] = (int)largest;
    if (!(fabs(N[largest * m + p]) > 0.0)) return 1;
    if (largest != p)
      for (j = 0; j < m; ++j) {
        const double held = N[p * m + j];
        N[p * m + j] = N[largest * m + j];
        N[largest * m + j] = held;
      }
    for (i = p + 1; i < m; ++i) {
      double *restrict row = N + i * m;
      const double *restrict top = N + p * m;
      double f;
      if (row[p] == 0.0) continue;
      f = row[p] /= top[p];
      for (j = p + 1; j < m; ++j) row[j] -= f * top[j];
    }
  }
  return 0;
}

static void solve_step(long m, const double *restrict N, const int *pivot, double *restrict x) {
  long i, j;
  for (i = 0; i < m; ++i) {
    const double held = x[pivot[i]];
    x[pivot[i]] = x[i];
    x[i] = held;
  }
  for (i = 1; i < m; ++i) {
    double sum = x[i];
    for (j = 0; j < i; ++j) sum -= N[i * m + j] * x[j];
    x[i] = sum;
  }
  for (i = m - 1; i >= 0; --i) {
    double sum = x[i];
    for (j = i + 1; j < m; ++j) sum -= N[i * m + j] * x[j];
    x[i] = sum / N[i * m + i];
  }
}

static void solve_transposed_step(long m, const double *restrict N, const int *pivot, double *restrict x) {
  long i, j;
  for (i = 0; i < m; ++i) {
    const double f = x[i] /= N[i * m + i];
    for (j = i + 1; j < m; ++j) x[j] -= f * N[i * m + j];
  }
  for (i = m - 1; i > 0; --i) {
    const double f = x[i];
    for (j = 0; j < i; ++j) x[j] -= f * N[i * m + j];
  }
  for (i = m - 1; i >= 0; --i) {
    const double held = x[pivot[i]];
    x[pivot[i]] = x[i];
    x[i] = held;
  }
}

EXPORT long collocation_factorise(long k, long n, const double *h, const double *A, const double *tableau, double *N,
                                  int *pivot) {
  const long m = 3 * n;
  long step, i, j, r, c;
  for (step = 0; step < k; ++step, A += 3 * n * n, N += m * m, pivot += m) {
    for (r = 0; r < n; ++r)
      for (i = 0; i < 3; ++i)
        for (c = 0; c < n; ++c)
          for (j = 0; j < 3; ++j)
            N[(3 * r + i) * m + 3 * c + j] =
                (r == c && i == j) - h[step] * tableau[3 * i + j] * A[(i * n + r) * n + c];
    if (factorise_step(m, N, pivot)) return step + 1;
  }
  return 0;
}

/* x' = A x + f from x at the start, which becomes x at the end */
EXPORT void collocation_forward(long k, long n, const double *h, const double *A, const double *tableau, const double *N,
                                const int *pivot, const double *f, double *x, double *stages, double *work) {
  const long m = 3 * n;
  const double *b = tableau + 9;
  long step, i, r, c;
  for (step = 0; step < k; ++step, A += 3 * n * n, N += m * m, pivot += m, f += m, stages += m) {
    for (i = 0; i < 3; ++i)
      for (r = 0; r < n; ++r) {
        const double *row = A + (i * n + r) * n;
        double sum = f[i * n + r];
        for (c = 0; c < n; ++c) sum += row[c] * x[c];
        work[3 * r + i] = sum;
      }
    solve_step(m, N, pivot, work);
    for (r = 0; r < n; ++r) {
      const double *rate = work + 3 * r;
      for (i = 0; i < 3; ++i)
        stages[i * n + r] = x[r] + h[step] * (tableau[3 * i] * rate[0] + tableau[3 * i + 1] * rate[1]
                                              + tableau[3 * i + 2] * rate[2]);
      x[r] += h[step] * (b[0] * rate[0] + b[1] * rate[1] + b[2] * rate[2]);
    }
  }
}

/* a' = -A' a - f from a at the end, which becomes a at the start */
EXPORT void collocation_backward(long k, long n, const double *h, const double *A, const double *tableau,
                                 const double *N, const int *pivot, const double *f, double *a, double *stages,
                                 double *work) {
  const long m = 3 * n;
  const double *b = tableau + 9;
  long step, i, j, r, c;
  for (step = k - 1; step >= 0; --step) {
    const double *at = A + step * 3 * n * n, *force = f + step * m;
    double *stage = stages + step * m;
    for (r = 0; r < n; ++r)
      for (i = 0; i < 3; ++i) {
        double sum = b[i] * a[r];
        for (j = 0; j < 3; ++j) sum += h[step] * tableau[3 * j + i] * b[j] * force[j * n + r];
        work[3 * r + i] = sum;
      }
    solve_transposed_step(m, N + step * m * m, pivot + step * m, work);
    for (i = 0; i < 3; ++i)
      for (r = 0; r < n; ++r) {
        const double *row = at + (i * n + r) * n;
        const double weighted = h[step] * work[3 * r + i];
        stage[i * n + r] = work[3 * r + i] / b[i];
        for (c = 0; c < n; ++c) a[c] += row[c] * weighted;
        a[r] += h[step] * b[i] * force[i * n + r];
      }
  }
}
