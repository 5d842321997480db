/* ---- Collocation with three stages: steps of a sparse system, unknowns ordered state by state, stages within. ----
 *
 * N = I - h A (a x I) is the matrix of the stage derivatives: a block of 3 x 3 for every entry of A, and those that
 * elimination adds. A plan (codegen/elimination.py) gives the order of elimination and where each block is stored.
 * The factors of LANES steps are made at once, side by side, and not kept: to make them anew in every pass costs no
 * more than to read them from memory. Blocks are pivots as they come; a pivot that is nearly singular ends the run.
 *
 * The tableau holds a by rows, then b.
 */

#define NEARLY_SINGULAR 1e-12

typedef struct {
  int states, blocks, entries;
  const int *pivot, *diagonal;               /* states in order of elimination, and their own blocks */
  const int *entry_row, *entry_column, *entry_block;
  const int *lower_start, *lower_row, *lower_block;    /* below each pivot */
  const int *upper_start, *upper_column, *upper_block; /* right of each pivot */
  const int *target;                         /* of each product lower x upper, in their order */
} Plan;

static Plan read_plan(const int *numbers) {
  Plan p;
  const int lowers = numbers[3], uppers = numbers[4];
  p.states = numbers[0];
  p.blocks = numbers[1];
  p.entries = numbers[2];
  p.pivot = numbers + 5;
  p.diagonal = p.pivot + p.states;
  p.entry_row = p.diagonal + p.states;
  p.entry_column = p.entry_row + p.entries;
  p.entry_block = p.entry_column + p.entries;
  p.lower_start = p.entry_block + p.entries;
  p.lower_row = p.lower_start + p.states + 1;
  p.lower_block = p.lower_row + lowers;
  p.upper_start = p.lower_block + lowers;
  p.upper_column = p.upper_start + p.states + 1;
  p.upper_block = p.upper_column + uppers;
  p.target = p.upper_block + uppers;
  return p;
}

typedef double Block[9][LANES];

/* Replace blocks by their inverses; return whether each is far from singular. */
static int invert(double (*restrict d)[LANES]) {
  int j, good = 1;
  for (j = 0; j < LANES; ++j) {
    const double a = d[0][j], b = d[1][j], c = d[2][j], e = d[3][j], f = d[4][j], g = d[5][j];
    const double k = d[6][j], l = d[7][j], m = d[8][j];
    const double A = f * m - g * l, B = g * k - e * m, C = e * l - f * k;
    const double determinant = a * A + b * B + c * C, r = 1.0 / determinant;
    const double size = fabs(a * A) + fabs(b * B) + fabs(c * C);
    good &= fabs(determinant) > NEARLY_SINGULAR * size;
    d[0][j] = A * r;
    d[1][j] = (c * l - b * m) * r;
    d[2][j] = (b * g - c * f) * r;
    d[3][j] = B * r;
    d[4][j] = (a * m - c * k) * r;
    d[5][j] = (c * e - a * g) * r;
    d[6][j] = C * r;
    d[7][j] = (b * k - a * l) * r;
    d[8][j] = (a * f - b * e) * r;
  }
  return good;
}

/* x = x y */
static void multiply(double (*restrict x)[LANES], const double (*restrict y)[LANES]) {
  int i, j, k;
  for (i = 0; i < 3; ++i) {
    double row[3][LANES];
    for (k = 0; k < 3; ++k)
      for (j = 0; j < LANES; ++j)
        row[k][j] = x[3 * i][j] * y[k][j] + x[3 * i + 1][j] * y[3 + k][j] + x[3 * i + 2][j] * y[6 + k][j];
    memcpy(x + 3 * i, row, sizeof row);
  }
}

/* z = z - x y */
static void subtract_product(double (*restrict z)[LANES], const double (*restrict x)[LANES], const double (*restrict y)[LANES]) {
  int i, j, k;
  for (i = 0; i < 3; ++i)
    for (k = 0; k < 3; ++k)
      for (j = 0; j < LANES; ++j)
        z[3 * i + k][j] -= x[3 * i][j] * y[k][j] + x[3 * i + 1][j] * y[3 + k][j] + x[3 * i + 2][j] * y[6 + k][j];
}

/* Factorise up to LANES steps from h, A on; factors (LANES, blocks, 9). Lanes beyond the last repeat it. */
static int factorise(const Plan *p, long valid, const double *h, const double *A, const double *tableau, Block *N,
                     double *factors) {
  const int *target = p->target;
  long at[LANES];
  int i, j, k, s, pivot, l, u;
  memset(N, 0, p->blocks * sizeof(Block));
  for (j = 0; j < LANES; ++j) at[j] = j < valid ? j : valid - 1;
  for (s = 0; s < 3; ++s)
    for (k = 0; k < p->entries; ++k) {
      double (*restrict row)[LANES] = N[p->entry_block[k]] + 3 * s;
      double entry[LANES];
      for (j = 0; j < LANES; ++j) entry[j] = h[at[j]] * A[(3 * at[j] + s) * p->entries + k];
      for (i = 0; i < 3; ++i)
        for (j = 0; j < LANES; ++j) row[i][j] = -tableau[3 * s + i] * entry[j];
    }
  for (i = 0; i < p->states; ++i)
    for (s = 0; s < 3; ++s)
      for (j = 0; j < LANES; ++j) N[p->diagonal[i]][4 * s][j] += 1.0;
  for (pivot = 0; pivot < p->states; ++pivot) {
    double (*own)[LANES] = N[p->diagonal[pivot]];
    if (!invert(own)) return 1;
    for (l = p->lower_start[pivot]; l < p->lower_start[pivot + 1]; ++l) {
      double (*lower)[LANES] = N[p->lower_block[l]];
      multiply(lower, (const double (*)[LANES])own);
      for (u = p->upper_start[pivot]; u < p->upper_start[pivot + 1]; ++u)
        subtract_product(N[*target++], (const double (*)[LANES])lower, (const double (*)[LANES])N[p->upper_block[u]]);
    }
  }
  for (j = 0; j < LANES; ++j)
    for (i = 0; i < p->blocks; ++i)
      for (k = 0; k < 9; ++k) factors[((long)j * p->blocks + i) * 9 + k] = N[i][k][j];
  return 0;
}

/* y = y - F x, y = y - F' x, x = F x and x = F' x with one block */
static inline void subtract(const double *restrict F, const double *restrict x, double *restrict y) {
  y[0] -= F[0] * x[0] + F[1] * x[1] + F[2] * x[2];
  y[1] -= F[3] * x[0] + F[4] * x[1] + F[5] * x[2];
  y[2] -= F[6] * x[0] + F[7] * x[1] + F[8] * x[2];
}

static inline void subtract_transposed(const double *restrict F, const double *restrict x, double *restrict y) {
  y[0] -= F[0] * x[0] + F[3] * x[1] + F[6] * x[2];
  y[1] -= F[1] * x[0] + F[4] * x[1] + F[7] * x[2];
  y[2] -= F[2] * x[0] + F[5] * x[1] + F[8] * x[2];
}

static inline void apply(const double *restrict F, double *restrict x) {
  const double a = x[0], b = x[1], c = x[2];
  x[0] = F[0] * a + F[1] * b + F[2] * c;
  x[1] = F[3] * a + F[4] * b + F[5] * c;
  x[2] = F[6] * a + F[7] * b + F[8] * c;
}

static inline void apply_transposed(const double *restrict F, double *restrict x) {
  const double a = x[0], b = x[1], c = x[2];
  x[0] = F[0] * a + F[3] * b + F[6] * c;
  x[1] = F[1] * a + F[4] * b + F[7] * c;
  x[2] = F[2] * a + F[5] * b + F[8] * c;
}

static void solve_step(const Plan *p, const double *restrict F, double *restrict x) {
  int i, l;
  for (i = 0; i < p->states; ++i)
    for (l = p->lower_start[i]; l < p->lower_start[i + 1]; ++l)
      subtract(F + 9 * p->lower_block[l], x + 3 * p->pivot[i], x + 3 * p->lower_row[l]);
  for (i = p->states - 1; i >= 0; --i) {
    for (l = p->upper_start[i]; l < p->upper_start[i + 1]; ++l)
      subtract(F + 9 * p->upper_block[l], x + 3 * p->upper_column[l], x + 3 * p->pivot[i]);
    apply(F + 9 * p->diagonal[i], x + 3 * p->pivot[i]);
  }
}

static void solve_transposed_step(const Plan *p, const double *restrict F, double *restrict x) {
  int i, l;
  for (i = 0; i < p->states; ++i) {
    apply_transposed(F + 9 * p->diagonal[i], x + 3 * p->pivot[i]);
    for (l = p->upper_start[i]; l < p->upper_start[i + 1]; ++l)
      subtract_transposed(F + 9 * p->upper_block[l], x + 3 * p->pivot[i], x + 3 * p->upper_column[l]);
  }
  for (i = p->states - 1; i >= 0; --i)
    for (l = p->lower_start[i]; l < p->lower_start[i + 1]; ++l)
      subtract_transposed(F + 9 * p->lower_block[l], x + 3 * p->lower_row[l], x + 3 * p->pivot[i]);
}

enum { SINGULAR = 1, NO_MEMORY = 2 };

/* x' = A x + f from x at the start, which becomes x at the end.
 *
 * A        (steps, 3, entries)
 * f        (steps, 3, states)
 * stages   (steps, 3, states)
 * edges    (steps + 1, states) x at the ends of the steps */
EXPORT int collocation_forward(long steps, const int *plan, const double *h, const double *A, const double *tableau,
                               const double *f, double *x, double *stages, double *edges) {
  const Plan p = read_plan(plan);
  const double *b = tableau + 9;
  Block *N = malloc(p.blocks * sizeof(Block));
  double *factors = malloc((size_t)LANES * p.blocks * 9 * sizeof(double));
  double *rates = malloc(3 * (size_t)p.states * sizeof(double));
  int code = N && factors && rates ? 0 : NO_MEMORY, i, k, r;
  long first, step;
  memcpy(edges, x, p.states * sizeof(double));
  for (first = 0; first < steps && !code; first += LANES) {
    const long valid = steps - first < LANES ? steps - first : LANES;
    if (factorise(&p, valid, h + first, A + first * 3 * p.entries, tableau, N, factors)) code = SINGULAR;
    for (step = first; step < first + valid && !code; ++step) {
      const double *force = f + step * 3 * p.states;
      double *stage = stages + step * 3 * p.states;
      for (i = 0; i < 3; ++i) {
        const double *a = A + (3 * step + i) * p.entries;
        for (r = 0; r < p.states; ++r) rates[3 * r + i] = force[i * p.states + r];
        for (k = 0; k < p.entries; ++k) rates[3 * p.entry_row[k] + i] += a[k] * x[p.entry_column[k]];
      }
      solve_step(&p, factors + (step - first) * p.blocks * 9, rates);
      for (r = 0; r < p.states; ++r) {
        const double *rate = rates + 3 * r;
        for (i = 0; i < 3; ++i)
          stage[i * p.states + r] = x[r] + h[step] * (tableau[3 * i] * rate[0] + tableau[3 * i + 1] * rate[1]
                                                      + tableau[3 * i + 2] * rate[2]);
        x[r] += h[step] * (b[0] * rate[0] + b[1] * rate[1] + b[2] * rate[2]);
      }
      memcpy(edges + (step + 1) * p.states, x, p.states * sizeof(double));
    }
  }
  free(N);
  free(factors);
  free(rates);
  return code;
}

/* a' = -A' a - f from a at the end, which becomes a at the start; arguments as above. */
EXPORT int collocation_backward(long steps, const int *plan, const double *h, const double *A, const double *tableau,
                                const double *f, double *a, double *stages, double *edges) {
  const Plan p = read_plan(plan);
  const double *b = tableau + 9;
  Block *N = malloc(p.blocks * sizeof(Block));
  double *factors = malloc((size_t)LANES * p.blocks * 9 * sizeof(double));
  double *rates = malloc(3 * (size_t)p.states * sizeof(double));
  int code = N && factors && rates ? 0 : NO_MEMORY, i, j, k, r;
  long last, step;
  memcpy(edges + steps * p.states, a, p.states * sizeof(double));
  for (last = steps; last > 0 && !code; last -= LANES) {
    const long first = last > LANES ? last - LANES : 0;
    if (factorise(&p, last - first, h + first, A + first * 3 * p.entries, tableau, N, factors)) code = SINGULAR;
    for (step = last - 1; step >= first && !code; --step) {
      const double *force = f + step * 3 * p.states;
      double *stage = stages + step * 3 * p.states;
      for (r = 0; r < p.states; ++r)
        for (i = 0; i < 3; ++i) {
          double sum = b[i] * a[r];
          for (j = 0; j < 3; ++j) sum += h[step] * tableau[3 * j + i] * b[j] * force[j * p.states + r];
          rates[3 * r + i] = sum;
        }
      solve_transposed_step(&p, factors + (step - first) * p.blocks * 9, rates);
      for (i = 0; i < 3; ++i) {
        const double *at = A + (3 * step + i) * p.entries;
        for (k = 0; k < p.entries; ++k)
          a[p.entry_column[k]] += h[step] * at[k] * rates[3 * p.entry_row[k] + i];
        for (r = 0; r < p.states; ++r) {
          stage[i * p.states + r] = rates[3 * r + i] / b[i];
          a[r] += h[step] * b[i] * force[i * p.states + r];
        }
      }
      memcpy(edges + step * p.states, a, p.states * sizeof(double));
    }
  }
  free(N);
  free(factors);
  free(rates);
  return code;
}
