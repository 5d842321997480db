/* ---- Collocation with four stages: steps of a sparse system, unknowns ordered state by state, stages within. ----
 *
 * M = I - h (a x I) A is the matrix of the states at the stages: a block of 4 x 4 for every entry of A, column by
 * column, and those that elimination adds. A plan (codegen/elimination.py) gives the order of elimination and where
 * each block is stored: in the order in which the solution forward reads them. Blocks are pivots as they come; a pivot
 * that is nearly singular ends the run. Of M = (L + D) (I + U) stand L, the inverses of D, and U; pivots known to be
 * the unit matrix, those of states whose rates do not hold themselves, are not stored.
 *
 * The tableau holds a by columns, then b, then d = b / a. With the states X at the stages, the state at the end of a
 * step is x + h b (A X + f). It is x + d (X - x) as well, without A, but X - x has lost digits, all the more in short
 * steps, and what is lost adds up.
 */

enum { STAGES = 4, BLOCK = STAGES * STAGES };
#define NEARLY_SINGULAR 1e-12

enum { UNIT = -1 };
enum { STOPPED = -1, SINGULAR, SOLVED }; /* what the exported functions return */

typedef struct {
  int states, blocks, entries;
  const int *pivot, *diagonal;           /* states in order of elimination, and their own blocks, UNIT without one */
  const int *entry_block, *entry_row, *entry_column;  /* of each entry of A */
  const int *left_start, *left_state, *left_block;    /* of each pivot's row: blocks eliminated before */
  const int *right_start, *right_state, *right_block; /* blocks that stay */
  const int *above_start, *above_state, *above_block; /* of each pivot's column: blocks that stay */
  const int *below_start, *below_state, *below_block; /* blocks to eliminate */
  const int *target;                     /* of each product below x right, in their order */
} Plan;

static Plan read_plan(const int *numbers) {
  Plan p;
  const int lower = numbers[3], upper = numbers[4];
  p.states = numbers[0];
  p.blocks = numbers[1];
  p.entries = numbers[2];
  p.pivot = numbers + 5;
  p.diagonal = p.pivot + p.states;
  p.entry_block = p.diagonal + p.states;
  p.entry_row = p.entry_block + p.entries;
  p.entry_column = p.entry_row + p.entries;
  p.left_start = p.entry_column + p.entries;
  p.left_state = p.left_start + p.states + 1;
  p.left_block = p.left_state + lower;
  p.right_start = p.left_block + lower;
  p.right_state = p.right_start + p.states + 1;
  p.right_block = p.right_state + upper;
  p.above_start = p.right_block + upper;
  p.above_state = p.above_start + p.states + 1;
  p.above_block = p.above_state + upper;
  p.below_start = p.above_block + upper;
  p.below_state = p.below_start + p.states + 1;
  p.below_block = p.below_state + lower;
  p.target = p.below_block + lower;
  return p;
}

/* Replace a block by its inverse, from minors of two rows; return whether it is far from singular. */
static int invert(double *restrict d) {
  const double a0 = d[0], a1 = d[1], a2 = d[2], a3 = d[3], b0 = d[4], b1 = d[5], b2 = d[6], b3 = d[7];
  const double c0 = d[8], c1 = d[9], c2 = d[10], c3 = d[11], e0 = d[12], e1 = d[13], e2 = d[14], e3 = d[15];
  /* minors of the first two and of the last two */
  const double u0 = a0 * b1 - b0 * a1, u1 = a0 * b2 - b0 * a2, u2 = a0 * b3 - b0 * a3;
  const double u3 = a1 * b2 - b1 * a2, u4 = a1 * b3 - b1 * a3, u5 = a2 * b3 - b2 * a3;
  const double l0 = c0 * e1 - e0 * c1, l1 = c0 * e2 - e0 * c2, l2 = c0 * e3 - e0 * c3;
  const double l3 = c1 * e2 - e1 * c2, l4 = c1 * e3 - e1 * c3, l5 = c2 * e3 - e2 * c3;
  const double determinant = u0 * l5 - u1 * l4 + u2 * l3 + u3 * l2 - u4 * l1 + u5 * l0, r = 1.0 / determinant;
  const double size = fabs(u0 * l5) + fabs(u1 * l4) + fabs(u2 * l3) + fabs(u3 * l2) + fabs(u4 * l1) + fabs(u5 * l0);
  d[0] = (b1 * l5 - b2 * l4 + b3 * l3) * r;
  d[1] = (-a1 * l5 + a2 * l4 - a3 * l3) * r;
  d[2] = (e1 * u5 - e2 * u4 + e3 * u3) * r;
  d[3] = (-c1 * u5 + c2 * u4 - c3 * u3) * r;
  d[4] = (-b0 * l5 + b2 * l2 - b3 * l1) * r;
  d[5] = (a0 * l5 - a2 * l2 + a3 * l1) * r;
  d[6] = (-e0 * u5 + e2 * u2 - e3 * u1) * r;
  d[7] = (c0 * u5 - c2 * u2 + c3 * u1) * r;
  d[8] = (b0 * l4 - b1 * l2 + b3 * l0) * r;
  d[9] = (-a0 * l4 + a1 * l2 - a3 * l0) * r;
  d[10] = (e0 * u4 - e1 * u2 + e3 * u0) * r;
  d[11] = (-c0 * u4 + c1 * u2 - c3 * u0) * r;
  d[12] = (-b0 * l3 + b1 * l1 - b2 * l0) * r;
  d[13] = (a0 * l3 - a1 * l1 + a2 * l0) * r;
  d[14] = (-e0 * u3 + e1 * u1 - e2 * u0) * r;
  d[15] = (c0 * u3 - c1 * u1 + c2 * u0) * r;
  return fabs(determinant) > NEARLY_SINGULAR * size;
}

typedef double Four __attribute__((vector_size(STAGES * sizeof(double)))); /* of GCC and Clang */

static inline Four load_four(const double *from) {
  Four x;
  memcpy(&x, from, sizeof x);
  return x;
}

static inline void store_four(double *to, Four x) { memcpy(to, &x, sizeof x); }

typedef struct {
  Four column[STAGES];
} Square;

static inline Square load_square(const double *from) {
  const Square F = { { load_four(from), load_four(from + 4), load_four(from + 8), load_four(from + 12) } };
  return F;
}

/* F x */
static inline Four times(Square F, const double *x) {
  return (F.column[0] * x[0] + F.column[1] * x[1]) + (F.column[2] * x[2] + F.column[3] * x[3]);
}

/* y - F x */
static inline Four less(Four y, Square F, const double *x) {
  int k;
  for (k = 0; k < STAGES; ++k) y -= F.column[k] * x[k];
  return y;
}

/* the sum of each column, as one vector: a store of single numbers would hold up the next load of all four */
static inline Four column_sums(Square F) {
  const Four a = F.column[0], b = F.column[1], c = F.column[2], d = F.column[3];
  const Four first = { a[0], b[0], c[0], d[0] }, second = { a[1], b[1], c[1], d[1] };
  const Four third = { a[2], b[2], c[2], d[2] }, fourth = { a[3], b[3], c[3], d[3] };
  return (first + second) + (third + fourth);
}

static int factorise(const Plan *p, double h, const double *A, const double *restrict tableau, double *N) {
  const int *target = p->target;
  Square scaled;
  int i, k, s, pivot, l, u;
  memset(N, 0, (size_t)p->blocks * BLOCK * sizeof(double));
  for (s = 0; s < STAGES; ++s) scaled.column[s] = -h * load_four(tableau + STAGES * s);
  for (k = 0; k < p->entries; ++k)
    for (s = 0; s < STAGES; ++s)
      store_four(N + BLOCK * p->entry_block[k] + STAGES * s, scaled.column[s] * A[s * p->entries + k]);
  for (i = 0; i < p->states; ++i)
    for (s = 0; s < BLOCK && p->diagonal[i] != UNIT; s += STAGES + 1) N[BLOCK * p->diagonal[i] + s] += 1.0;
  for (pivot = 0; pivot < p->states; ++pivot) {
    if (p->diagonal[pivot] != UNIT) {
      double *own = N + BLOCK * p->diagonal[pivot];
      if (!invert(own)) return 0;
      const Square inverse = load_square(own);
      for (u = p->right_start[pivot]; u < p->right_start[pivot + 1]; ++u)
        for (s = 0; s < BLOCK; s += STAGES) {
          double *column = N + BLOCK * p->right_block[u] + s;
          store_four(column, times(inverse, column));
        }
    }
    for (l = p->below_start[pivot]; l < p->below_start[pivot + 1]; ++l) {
      const Square below = load_square(N + BLOCK * p->below_block[l]);
      for (u = p->right_start[pivot]; u < p->right_start[pivot + 1]; ++u) {
        double *to = N + BLOCK * *target++;
        const double *right = N + BLOCK * p->right_block[u];
        for (s = 0; s < BLOCK; s += STAGES) store_four(to + s, less(load_four(to + s), below, right + s));
      }
    }
  }
  return 1;
}

/* Return x less the sum of F y over listed blocks. */
static inline Four less_rows(int first, int last, const int *restrict block, const int *restrict state, const double *F,
                             const double *all, const double *x) {
  Four sum[STAGES] = { load_four(x) };
  int k, l;
  for (l = first; l < last; ++l) {
    const double *f = F + BLOCK * block[l], *y = all + STAGES * state[l];
    for (k = 0; k < STAGES; ++k) sum[k] -= load_four(f + STAGES * k) * y[k];
  }
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/* Return x less the sum of F' y over listed blocks. */
static inline Four less_columns(int first, int last, const int *restrict block, const int *restrict state,
                                const double *F, const double *all, const double *x) {
  Square sum = { { { 0.0 } } };
  int k, l;
  for (l = first; l < last; ++l) {
    const double *f = F + BLOCK * block[l];
    const Four y = load_four(all + STAGES * state[l]);
    for (k = 0; k < STAGES; ++k) sum.column[k] += load_four(f + STAGES * k) * y;
  }
  return load_four(x) - column_sums(sum);
}

static void solve_step(const Plan *p, const double *F, double *x) {
  int i;
  for (i = 0; i < p->states; ++i) {
    double *own = x + STAGES * p->pivot[i];
    store_four(own, less_rows(p->left_start[i], p->left_start[i + 1], p->left_block, p->left_state, F, x, own));
    if (p->diagonal[i] != UNIT) store_four(own, times(load_square(F + BLOCK * p->diagonal[i]), own));
  }
  for (i = p->states - 1; i >= 0; --i) {
    double *own = x + STAGES * p->pivot[i];
    store_four(own, less_rows(p->right_start[i], p->right_start[i + 1], p->right_block, p->right_state, F, x, own));
  }
}

static void solve_transposed_step(const Plan *p, const double *F, double *x) {
  int i, k;
  for (i = 0; i < p->states; ++i) {
    double *own = x + STAGES * p->pivot[i];
    store_four(own, less_columns(p->above_start[i], p->above_start[i + 1], p->above_block, p->above_state, F, x, own));
  }
  for (i = p->states - 1; i >= 0; --i) {
    double *own = x + STAGES * p->pivot[i];
    const Four rest =
        less_columns(p->below_start[i], p->below_start[i + 1], p->below_block, p->below_state, F, x, own);
    store_four(own, rest);
    if (p->diagonal[i] != UNIT) {
      Square inverse = load_square(F + BLOCK * p->diagonal[i]);
      for (k = 0; k < STAGES; ++k) inverse.column[k] *= rest;
      store_four(own, column_sums(inverse));
    }
  }
}

/* Factorise all steps; return SINGULAR if a pivot nearly is.
 *
 * A        (steps, STAGES, entries)
 * factors  (steps, blocks, BLOCK)
 * stop     looked at in every step; not zero ends the call */
EXPORT int collocation_factorise(long steps, const int *plan, const double *h, const double *A, const double *tableau,
                                 double *factors, const volatile int *stop) {
  const Plan p = read_plan(plan);
  long step;
  for (step = 0; step < steps; ++step) {
    if (*stop) return STOPPED;
    if (!factorise(&p, h[step], A + step * STAGES * p.entries, tableau, factors + step * p.blocks * BLOCK)) return SINGULAR;
  }
  return SOLVED;
}

/* x' = A x + f from x at the start, which becomes x at the end; return SINGULAR if a pivot nearly is.
 *
 * kept     whether factors holds those of all steps; else it has room for one step, which is factorised on the way
 * f        (steps, STAGES, states)
 * stages   (steps, STAGES, states)
 * edges    (steps + 1, states) x at the ends of the steps
 * work     (STAGES states) */
EXPORT int collocation_forward(long steps, const int *plan, const double *h, const double *A, const double *tableau,
                               double *factors, int kept, const double *f, double *x, double *stages, double *edges,
                               double *work, const volatile int *stop) {
  const Plan p = read_plan(plan);
  const double *b = tableau + BLOCK;
  const Square a = load_square(tableau);
  long step;
  int i, k, r;
  memcpy(edges, x, p.states * sizeof(double));
  for (step = 0; step < steps; ++step) {
    const double *force = f + step * STAGES * p.states, *matrix = A + step * STAGES * p.entries;
    double *stage = stages + step * STAGES * p.states, *F = factors + (kept ? step * p.blocks * BLOCK : 0);
    if (*stop) return STOPPED;
    if (!kept && !factorise(&p, h[step], matrix, tableau, F)) return SINGULAR;
    for (r = 0; r < p.states; ++r) {
      const double own[STAGES] = { force[r], force[p.states + r], force[2 * p.states + r], force[3 * p.states + r] };
      store_four(work + STAGES * r, x[r] + h[step] * times(a, own));
    }
    solve_step(&p, F, work);
    for (r = 0; r < p.states; ++r)
      for (i = 0; i < STAGES; ++i) stage[i * p.states + r] = work[STAGES * r + i];
    memset(work, 0, p.states * sizeof(double));
    for (i = 0; i < STAGES; ++i) {
      const double *at = stage + i * p.states, *own = matrix + i * p.entries;
      for (k = 0; k < p.entries; ++k) work[p.entry_row[k]] += b[i] * own[k] * at[p.entry_column[k]];
      for (r = 0; r < p.states; ++r) work[r] += b[i] * force[i * p.states + r];
    }
    for (r = 0; r < p.states; ++r) x[r] += h[step] * work[r];
    memcpy(edges + (step + 1) * p.states, x, p.states * sizeof(double));
  }
  return SOLVED;
}

/* a' = -A' a - f from a at the end, which becomes a at the start; arguments as above.
 *
 * The discrete adjoint of the steps above: M' V = d a + h b f, the adjoint at the stages a' V / b, at the start of the
 * step a + h b (A' a' V / b + f). */
EXPORT int collocation_backward(long steps, const int *plan, const double *h, const double *A, const double *tableau,
                                double *factors, int kept, const double *f, double *a, double *stages, double *edges,
                                double *work, const volatile int *stop) {
  const Plan p = read_plan(plan);
  const double *b = tableau + BLOCK, *d = b + STAGES;
  long step;
  int i, k, r;
  memcpy(edges + steps * p.states, a, p.states * sizeof(double));
  for (step = steps - 1; step >= 0; --step) {
    const double *force = f + step * STAGES * p.states, *matrix = A + step * STAGES * p.entries;
    double *stage = stages + step * STAGES * p.states, *F = factors + (kept ? step * p.blocks * BLOCK : 0);
    if (*stop) return STOPPED;
    if (!kept && !factorise(&p, h[step], matrix, tableau, F)) return SINGULAR;
    for (r = 0; r < p.states; ++r)
      for (i = 0; i < STAGES; ++i) work[STAGES * r + i] = d[i] * a[r] + h[step] * b[i] * force[i * p.states + r];
    solve_transposed_step(&p, F, work);
    for (r = 0; r < p.states; ++r) {
      const double *v = work + STAGES * r, *column = tableau;
      for (i = 0; i < STAGES; ++i, column += STAGES)
        stage[i * p.states + r] = ((column[0] * v[0] + column[1] * v[1]) + (column[2] * v[2] + column[3] * v[3])) / b[i];
    }
    memset(work, 0, p.states * sizeof(double));
    for (i = 0; i < STAGES; ++i) {
      const double *at = stage + i * p.states, *own = matrix + i * p.entries;
      for (k = 0; k < p.entries; ++k) work[p.entry_column[k]] += b[i] * own[k] * at[p.entry_row[k]];
      for (r = 0; r < p.states; ++r) work[r] += b[i] * force[i * p.states + r];
    }
    for (r = 0; r < p.states; ++r) a[r] += h[step] * work[r];
    memcpy(edges + step * p.states, a, p.states * sizeof(double));
  }
  return SOLVED;
}
