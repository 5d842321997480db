/* ---- Collocation with four stages: steps of a sparse system, unknowns ordered state by state, stages within. ----
 *
 * N = I - h A (a x I) is the matrix of the stage derivatives: a block of 4 x 4 for every entry of A, and those that
 * elimination adds. A plan (codegen/elimination.py) gives the order of elimination and where each block is stored.
 * The factors of LANES steps are made at once, side by side. Blocks are pivots as they come; a pivot that is nearly
 * singular ends the run.
 *
 * The tableau holds a by rows, then b.
 */

enum { STAGES = 4, BLOCK = STAGES * STAGES };
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

typedef double Block[BLOCK][LANES];

/* Replace blocks by their inverses, from minors of two rows; return whether each is far from singular. */
static int invert(double (*restrict d)[LANES]) {
  int j, good = 1;
  for (j = 0; j < LANES; ++j) {
    const double a0 = d[0][j], a1 = d[1][j], a2 = d[2][j], a3 = d[3][j];
    const double b0 = d[4][j], b1 = d[5][j], b2 = d[6][j], b3 = d[7][j];
    const double c0 = d[8][j], c1 = d[9][j], c2 = d[10][j], c3 = d[11][j];
    const double e0 = d[12][j], e1 = d[13][j], e2 = d[14][j], e3 = d[15][j];
    /* minors of the upper two rows and of the lower two */
    const double u0 = a0 * b1 - b0 * a1, u1 = a0 * b2 - b0 * a2, u2 = a0 * b3 - b0 * a3;
    const double u3 = a1 * b2 - b1 * a2, u4 = a1 * b3 - b1 * a3, u5 = a2 * b3 - b2 * a3;
    const double l0 = c0 * e1 - e0 * c1, l1 = c0 * e2 - e0 * c2, l2 = c0 * e3 - e0 * c3;
    const double l3 = c1 * e2 - e1 * c2, l4 = c1 * e3 - e1 * c3, l5 = c2 * e3 - e2 * c3;
    const double determinant = u0 * l5 - u1 * l4 + u2 * l3 + u3 * l2 - u4 * l1 + u5 * l0, r = 1.0 / determinant;
    const double size = fabs(u0 * l5) + fabs(u1 * l4) + fabs(u2 * l3) + fabs(u3 * l2) + fabs(u4 * l1) + fabs(u5 * l0);
    good &= fabs(determinant) > NEARLY_SINGULAR * size;
    d[0][j] = (b1 * l5 - b2 * l4 + b3 * l3) * r;
    d[1][j] = (-a1 * l5 + a2 * l4 - a3 * l3) * r;
    d[2][j] = (e1 * u5 - e2 * u4 + e3 * u3) * r;
    d[3][j] = (-c1 * u5 + c2 * u4 - c3 * u3) * r;
    d[4][j] = (-b0 * l5 + b2 * l2 - b3 * l1) * r;
    d[5][j] = (a0 * l5 - a2 * l2 + a3 * l1) * r;
    d[6][j] = (-e0 * u5 + e2 * u2 - e3 * u1) * r;
    d[7][j] = (c0 * u5 - c2 * u2 + c3 * u1) * r;
    d[8][j] = (b0 * l4 - b1 * l2 + b3 * l0) * r;
    d[9][j] = (-a0 * l4 + a1 * l2 - a3 * l0) * r;
    d[10][j] = (e0 * u4 - e1 * u2 + e3 * u0) * r;
    d[11][j] = (-c0 * u4 + c1 * u2 - c3 * u0) * r;
    d[12][j] = (-b0 * l3 + b1 * l1 - b2 * l0) * r;
    d[13][j] = (a0 * l3 - a1 * l1 + a2 * l0) * r;
    d[14][j] = (-e0 * u3 + e1 * u1 - e2 * u0) * r;
    d[15][j] = (c0 * u3 - c1 * u1 + c2 * u0) * r;
  }
  return good;
}

/* z = z + sign x y */
static inline void add_product(const double sign, double (*restrict z)[LANES], const double (*restrict x)[LANES],
                               const double (*restrict y)[LANES]) {
  int i, j, k;
  for (i = 0; i < STAGES; ++i)
    for (k = 0; k < STAGES; ++k)
      for (j = 0; j < LANES; ++j)
        z[STAGES * i + k][j] += sign * (x[STAGES * i][j] * y[k][j] + x[STAGES * i + 1][j] * y[STAGES + k][j]
                                        + x[STAGES * i + 2][j] * y[2 * STAGES + k][j]
                                        + x[STAGES * i + 3][j] * y[3 * STAGES + k][j]);
}

/* Factorise up to LANES steps from h, A on. Lanes beyond the last repeat it. */
static int factorise(const Plan *p, long valid, const double *h, const double *A, const double *tableau, Block *N,
                     double *factors) {
  const int *target = p->target;
  long at[LANES];
  Block copy;
  int i, j, k, s, pivot, l, u;
  memset(N, 0, p->blocks * sizeof(Block));
  for (j = 0; j < LANES; ++j) at[j] = j < valid ? j : valid - 1;
  for (s = 0; s < STAGES; ++s)
    for (k = 0; k < p->entries; ++k) {
      double (*restrict row)[LANES] = N[p->entry_block[k]] + STAGES * s;
      double entry[LANES];
      for (j = 0; j < LANES; ++j) entry[j] = h[at[j]] * A[(STAGES * at[j] + s) * p->entries + k];
      for (i = 0; i < STAGES; ++i)
        for (j = 0; j < LANES; ++j) row[i][j] = -tableau[STAGES * s + i] * entry[j];
    }
  for (i = 0; i < p->states; ++i)
    for (s = 0; s < STAGES; ++s)
      for (j = 0; j < LANES; ++j) N[p->diagonal[i]][(STAGES + 1) * s][j] += 1.0;
  for (pivot = 0; pivot < p->states; ++pivot) {
    double (*own)[LANES] = N[p->diagonal[pivot]];
    if (!invert(own)) return 1;
    for (l = p->lower_start[pivot]; l < p->lower_start[pivot + 1]; ++l) {
      double (*lower)[LANES] = N[p->lower_block[l]];
      memcpy(copy, lower, sizeof copy);
      memset(lower, 0, sizeof copy);
      add_product(1.0, lower, (const double (*)[LANES])copy, (const double (*)[LANES])own);
      for (u = p->upper_start[pivot]; u < p->upper_start[pivot + 1]; ++u)
        add_product(-1.0, N[*target++], (const double (*)[LANES])lower, (const double (*)[LANES])N[p->upper_block[u]]);
    }
  }
  for (j = 0; j < valid; ++j)
    for (i = 0; i < p->blocks; ++i)
      for (k = 0; k < BLOCK; ++k) factors[((long)j * p->blocks + i) * BLOCK + k] = N[i][k][j];
  return 0;
}

/* y = y - F x, y = y - F' x, x = F x and x = F' x with one block */
static inline void subtract(const double *restrict F, const double *restrict x, double *restrict y) {
  int i;
  for (i = 0; i < STAGES; ++i, F += STAGES) y[i] -= F[0] * x[0] + F[1] * x[1] + F[2] * x[2] + F[3] * x[3];
}

static inline void subtract_transposed(const double *restrict F, const double *restrict x, double *restrict y) {
  int i;
  for (i = 0; i < STAGES; ++i) y[i] -= F[i] * x[0] + F[4 + i] * x[1] + F[8 + i] * x[2] + F[12 + i] * x[3];
}

static inline void apply(const double *restrict F, double *restrict x) {
  double y[STAGES] = { 0.0 };
  subtract(F, x, y);
  for (int i = 0; i < STAGES; ++i) x[i] = -y[i];
}

static inline void apply_transposed(const double *restrict F, double *restrict x) {
  double y[STAGES] = { 0.0 };
  subtract_transposed(F, x, y);
  for (int i = 0; i < STAGES; ++i) x[i] = -y[i];
}

static void solve_step(const Plan *p, const double *restrict F, double *restrict x) {
  int i, l;
  for (i = 0; i < p->states; ++i)
    for (l = p->lower_start[i]; l < p->lower_start[i + 1]; ++l)
      subtract(F + BLOCK * p->lower_block[l], x + STAGES * p->pivot[i], x + STAGES * p->lower_row[l]);
  for (i = p->states - 1; i >= 0; --i) {
    for (l = p->upper_start[i]; l < p->upper_start[i + 1]; ++l)
      subtract(F + BLOCK * p->upper_block[l], x + STAGES * p->upper_column[l], x + STAGES * p->pivot[i]);
    apply(F + BLOCK * p->diagonal[i], x + STAGES * p->pivot[i]);
  }
}

static void solve_transposed_step(const Plan *p, const double *restrict F, double *restrict x) {
  int i, l;
  for (i = 0; i < p->states; ++i) {
    apply_transposed(F + BLOCK * p->diagonal[i], x + STAGES * p->pivot[i]);
    for (l = p->upper_start[i]; l < p->upper_start[i + 1]; ++l)
      subtract_transposed(F + BLOCK * p->upper_block[l], x + STAGES * p->pivot[i], x + STAGES * p->upper_column[l]);
  }
  for (i = p->states - 1; i >= 0; --i)
    for (l = p->lower_start[i]; l < p->lower_start[i + 1]; ++l)
      subtract_transposed(F + BLOCK * p->lower_block[l], x + STAGES * p->lower_row[l], x + STAGES * p->pivot[i]);
}

enum { SINGULAR = 1, NO_MEMORY = 2 };

/* Factorise all steps.
 *
 * A        (steps, STAGES, entries)
 * factors  (steps, blocks, BLOCK) */
EXPORT int collocation_factorise(long steps, const int *plan, const double *h, const double *A, const double *tableau,
                                 double *factors) {
  const Plan p = read_plan(plan);
  const long size = (long)p.blocks * BLOCK;
  Block *N = malloc(p.blocks * sizeof(Block));
  int code = N ? 0 : NO_MEMORY;
  long first;
  for (first = 0; first < steps && !code; first += LANES) {
    const long valid = steps - first < LANES ? steps - first : LANES;
    if (factorise(&p, valid, h + first, A + first * STAGES * p.entries, tableau, N, factors + first * size))
      code = SINGULAR;
  }
  free(N);
  return code;
}

/* x' = A x + f from x at the start, which becomes x at the end.
 *
 * f        (steps, STAGES, states)
 * stages   (steps, STAGES, states)
 * edges    (steps + 1, states) x at the ends of the steps
 * work     (STAGES states) */
EXPORT void collocation_forward(long steps, const int *plan, const double *h, const double *A, const double *tableau,
                                const double *factors, const double *f, double *x, double *stages, double *edges,
                                double *work) {
  const Plan p = read_plan(plan);
  const double *b = tableau + BLOCK;
  long step;
  int i, k, r;
  memcpy(edges, x, p.states * sizeof(double));
  for (step = 0; step < steps; ++step) {
    const double *force = f + step * STAGES * p.states;
    double *stage = stages + step * STAGES * p.states;
    for (i = 0; i < STAGES; ++i) {
      const double *a = A + (STAGES * step + i) * p.entries;
      for (r = 0; r < p.states; ++r) work[STAGES * r + i] = force[i * p.states + r];
      for (k = 0; k < p.entries; ++k) work[STAGES * p.entry_row[k] + i] += a[k] * x[p.entry_column[k]];
    }
    solve_step(&p, factors + step * p.blocks * BLOCK, work);
    for (r = 0; r < p.states; ++r) {
      const double *rate = work + STAGES * r;
      for (i = 0; i < STAGES; ++i)
        stage[i * p.states + r] = x[r] + h[step] * (tableau[4 * i] * rate[0] + tableau[4 * i + 1] * rate[1]
                                                    + tableau[4 * i + 2] * rate[2] + tableau[4 * i + 3] * rate[3]);
      x[r] += h[step] * (b[0] * rate[0] + b[1] * rate[1] + b[2] * rate[2] + b[3] * rate[3]);
    }
    memcpy(edges + (step + 1) * p.states, x, p.states * sizeof(double));
  }
}

/* a' = -A' a - f from a at the end, which becomes a at the start; arguments as above. */
EXPORT void collocation_backward(long steps, const int *plan, const double *h, const double *A, const double *tableau,
                                 const double *factors, const double *f, double *a, double *stages, double *edges,
                                 double *work) {
  const Plan p = read_plan(plan);
  const double *b = tableau + BLOCK;
  long step;
  int i, j, k, r;
  memcpy(edges + steps * p.states, a, p.states * sizeof(double));
  for (step = steps - 1; step >= 0; --step) {
    const double *force = f + step * STAGES * p.states;
    double *stage = stages + step * STAGES * p.states;
    for (r = 0; r < p.states; ++r)
      for (i = 0; i < STAGES; ++i) {
        double sum = b[i] * a[r];
        for (j = 0; j < STAGES; ++j) sum += h[step] * tableau[STAGES * j + i] * b[j] * force[j * p.states + r];
        work[STAGES * r + i] = sum;
      }
    solve_transposed_step(&p, factors + step * p.blocks * BLOCK, work);
    for (i = 0; i < STAGES; ++i) {
      const double *at = A + (STAGES * step + i) * p.entries;
      for (k = 0; k < p.entries; ++k) a[p.entry_column[k]] += h[step] * at[k] * work[STAGES * p.entry_row[k] + i];
      for (r = 0; r < p.states; ++r) {
        stage[i * p.states + r] = work[STAGES * r + i] / b[i];
        a[r] += h[step] * b[i] * force[i * p.states + r];
      }
    }
    memcpy(edges + step * p.states, a, p.states * sizeof(double));
  }
}
