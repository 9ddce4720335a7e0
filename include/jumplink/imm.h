/* The interacting multiple model filter (IMM): M Kalman filters, one a mode,
 * that exchange their estimates before every step in proportion to the
 * probability of the jumps between their modes.
 * (Blom, Bar-Shalom 1988; Pan, Dai, Zhang 1997, eq. 5-20, misprints mended.)
 *
 *     mix       c_j   = sum_i Pi[i][j] mu_i
 *               mu_ij = Pi[i][j] mu_i / c_j
 *               x0_j  = sum_i mu_ij x_i
 *               P0_j  = sum_i mu_ij (P_i + (x_i - x0_j)(x_i - x0_j)')
 *     filter    x_j, P_j, l_j = predict and update of mode j from x0_j, P0_j
 *     weigh     log mu_j = log c_j + l_j - loglik
 *               loglik   = log sum_j exp(log c_j + l_j)
 *     combine   xhat = sum_j mu_j x_j
 *               Phat = sum_j mu_j (P_j + (x_j - xhat)(x_j - xhat)')
 *
 * Probabilities next to nothing are kept as logarithms: a measurement 1000 sigma
 * away from every mode, or a mode that was improbable for an hour, does no harm.
 * A mode that cannot be entered (c_j = 0) keeps its own estimate unmixed.
 *
 * Mixing costs O(M^2 n^2), with factors O(M^2 n^3).  If Pi = diag(lambda)
 * + 1 v' with lambda >= 0 (stay with probability p, else anywhere alike; any
 * 2 x 2 chain with Pi00 + Pi11 >= 1) mode j pools only its own estimate and the
 * combined one, O(M n^2) and O(M n^3):
 *               c_j  = lambda_j mu_j + v_j,  a = lambda_j mu_j / c_j,
 *               b    = v_j / c_j,            d = x_j - xhat
 *               x0_j = a x_j + b xhat,  P0_j = a P_j + b Phat + a b d d'
 * Equal in exact arithmetic; found out by jl_imm_chain.
 *
 * A step computes into a second set of estimates, and weigh, the last stage
 * that changes the filter's state (x, P, mu), makes it the valid one.
 * So on any error the state is as it was before the step; xhat, Phat and
 * loglik are results, and combine brings them up to the state at any time.
 */
#ifndef JL_IMM_H
#define JL_IMM_H

#include "base.h"
#include "kf.h"
#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {                          /* how to mix */
    JL_MIX_AUTO = 0,            /* sticky where the chain allows it         */
    JL_MIX_GENERAL = 1          /* always the general sums                  */
};

/* Reals of state: two sets of estimates of M modes, the combined estimate (its
 * covariance also as the form keeps it), Pi, the innovations, and ten vectors
 * over the modes. */
#define JL_IMM_STATE(M, n, m) \
    (2 * (M) * ((n) + (n) * (n)) + 3 * (n) + 2 * (n) * (n) + (M) * (M) \
     + (M) * (m) + 10 * (M))
#define JL_IMM_SCRATCH(M, n, m) (JL_KF_SCRATCH(n, m) + (M) + 2 * (n))

typedef struct jl_imm {
    int M, n, m;
    const jl_mode *modes;       /* [M]                                      */
    const jl_kf_form *form;
    int mixing;                 /* JL_MIX_...                               */
    int sticky;                 /* Pi = diag(lambda) + 1 v' is used         */
    int stage;                  /* what may come next; see the calls        */
    int combined;               /* xhat, Phat belong to the present state   */
    int verdict;                /* on the z of the step under way, or of the
                                   last: JL_ACCEPTED, JL_MISSING, JL_REJECTED */

    /* of modes that lack components (jl_imm_init_sizes) */
    const int *const *map;      /* [M][modes[j].n]                          */
    const jl_real *prior_x;     /* [n]                                      */
    const jl_real *prior_var;   /* [n]                                      */

    /* gate */
    jl_real gate;               /* a mode rejects above this nis; 0: no gate */
    int most;                   /* rejections in a row; then accept         */
    int run;                    /* ... so many since the last accepted      */
    unsigned long rejected;     /* all since set                            */

    /* the state: valid between steps */
    jl_real *x;                 /* [M,n]                                    */
    jl_real *P;                 /* [M,n,n] as the form keeps it: jl_imm_cov */
    jl_real *mu;                /* [M]                                      */
    jl_real *logmu;             /* [M] log mu where mu is next to nothing, or
                                   nothing, else 0: jl_imm_logmu            */

    /* results of combine and weigh */
    jl_real *xhat;              /* [n]                                      */
    jl_real *Phat;              /* [n,n] a covariance, in any form          */
    jl_real *Shat;              /* [n,n] ... as the form keeps it           */
    jl_real loglik;             /* of the last measurement                  */
    jl_real *nis_mean;          /* [M] mean nis of those accepted since set */
    unsigned long accepted;     /* ... so many                              */

    /* the step under way: mixed, then predicted, then updated */
    jl_real *xw;                /* [M,n] with a gate, of modes that reject,
                                   predicted only until judge               */
    jl_real *Pw;                /* [M,n,n]                                  */
    jl_real *c;                 /* [M] predicted probabilities              */
    jl_real *logc;              /* [M] log c, likewise                      */
    jl_real *l;                 /* [M] log-likelihoods                      */
    jl_real *nis;               /* [M] nu' S^-1 nu; 0 without z             */
    jl_real *nu;                /* [M,m] innovations                        */
    jl_real *e;                 /* [M] work                                 */
    jl_real *d;                 /* [2n] work                                */

    /* the chain */
    jl_real *Pi;                /* [M,M]                                    */
    jl_real *lambda;            /* [M]                                      */
    jl_real *v;                 /* [M]                                      */
} jl_imm;

/* Bind a filter to its modes, form and memory: modes [M] of equal n and m,
 * mem [cap] reals, cap >= JL_IMM_STATE(M, n, m); all outlive the filter.  Pi is
 * the identity, mu uniform, x = 0, P = I in every mode; no gate.
 * Returns JL_OK, JL_EDIM (M outside 1..JL_MAX_MODES, unequal sizes, a form for
 * other sizes, mixing), JL_ENOMEM; *imm is untouched on error. */
int jl_imm_init(jl_imm *imm, int M, const jl_mode *modes,
                const jl_kf_form *form, int mixing, jl_real *mem, int cap);

/* The same with modes of different states, n components in all: mode j has
 * modes[j].n of them, map[j][0] < map[j][1] < .. < n in this order (NULL: all).
 * What it lacks is, after each of its predictions, independent of the rest:
 *     x_j[i] = prior_x[i],  P_j[i][i] = prior_var[i] > 0
 * as if it were padded to n by zeros in F and H and a noise of this mean and
 * variance; but predict and update cost what its own size does.
 *
 * The prior says what the component is like when a mode that has it takes over:
 * an acceleration within +-a at the start of a manoeuvre has mean 0, variance
 * a^2/3.  A deviation three times too large or small costs little.  With nearly
 * none, which is how padding goes wrong, every mixing tells the modes that have
 * the component that it is known, and they are slow to see it change; with a
 * huge one they forget what they knew.  xhat and Phat count the prior, too.
 * (Granstrom, Willett, Bar-Shalom 2015, IEEE Trans. AES 51, 2975, on what else
 * is done.  Yuan, Bar-Shalom, Willett et al. 2012, IEEE Trans. AES 48, 3250, fill
 * in the receiving mode's own estimate: slow again when that was certain, and
 * another for each mode, so that there is no sticky mixing.)
 *
 *     static const int cv[] = { 0, 1, 3, 4 };     (of x vx ax y vy ay)
 *     static const int *const map[] = { cv, NULL };
 *     static const jl_real mean[6], var[6] = { 0, 0, 30, 0, 0, 30 };
 *
 * prior_x, prior_var [n] are read only where a mode lacks the component; they
 * and the maps outlive the filter and do not change.
 * Returns as jl_imm_init, JL_EDIM also for a map that is not as said, a
 * component that no mode has, or a form for fixed sizes where one is lacking;
 * JL_ENONFINITE, JL_ERANGE (a variance that is not above 0) for a prior. */
int jl_imm_init_sizes(jl_imm *imm, int M, int n, const jl_mode *modes,
                      const int *const *map, const jl_real *prior_x,
                      const jl_real *prior_var, const jl_kf_form *form,
                      int mixing, jl_real *mem, int cap);

/* Gate: as jl_kf_gate, for a measurement whose nis is above `nis` in every mode
 * that is possible: then the modes are only predicted, and mu becomes c.  One
 * that a mode accepts is used by all: the bits are those without a gate.  (If
 * each mode had a gate by itself, one that rejects would avoid a bad
 * likelihood, and win.)  Ends a step under way.
 * Returns JL_OK, or JL_ERANGE (nis not finite or below 0, most below 0). */
int jl_imm_gate(jl_imm *imm, jl_real nis, int most);

/* The covariance P [n,n] of mode j's present estimate, in any form. */
void jl_imm_cov(const jl_imm *imm, int j, jl_real *P);

/* log mu_j of the present estimate, also where mu_j is too small for a number:
 * a mode a million times less likely each step comes back after an hour. */
jl_real jl_imm_logmu(const jl_imm *imm, int j);

/* Set the chain: Pi [M,M], rows sum to 1 (copied).  May be called between any
 * two steps, so a chain that depends on the time step is set before each.
 * Returns JL_OK, JL_ENONFINITE, JL_EPROB; unchanged on error. */
int jl_imm_chain(jl_imm *imm, const jl_real *Pi);

/* Set the state: x [M,n], P [M,n,n], mu [M] (copied); scratch
 * [JL_IMM_SCRATCH(M, n, m)].  A probability of 0 is allowed.  Modes of
 * different states have their components at their places among the n
 * (jl_motion_start of the motion that has all fits the others, too); of those
 * that a mode lacks, x and P are checked (zeros will do) and the prior is set.
 * Returns JL_OK, JL_ENONFINITE, JL_EASYM, JL_EDEF, JL_EPROB; unchanged on
 * error. */
int jl_imm_set(jl_imm *imm, const jl_real *x, const jl_real *P,
               const jl_real *mu, jl_real *scratch);

/* One step: mix, filter, weigh, combine.  z [m], or NULL for a missing
 * measurement: the modes are only predicted, log mu = log c, loglik = 0; the
 * same with one that the gate rejects.
 * Returns JL_OK, or the code of the first mode that failed: JL_ENONFINITE,
 * JL_ESINGULAR, a nonlinear mode's own; the filter is then as before the
 * step. */
int jl_imm_step(jl_imm *imm, const jl_real *z, jl_real *scratch);

/* The stages, scratch as above, in this order; mix may be called at any
 * time and starts the step anew; combine combines the present state and may be
 * called at any time.
 * Returns: as jl_imm_step, and JL_EORDER for filter without mix, or weigh
 * without filter or after a failure.  chain, set and gate end a step under
 * way. */
int jl_imm_mix(jl_imm *imm, jl_real *scratch);
int jl_imm_filter(jl_imm *imm, const jl_real *z, jl_real *scratch);
int jl_imm_weigh(jl_imm *imm);
void jl_imm_combine(jl_imm *imm);

/* The pieces of mix and filter, for filters spread over several processors:
 * mix = foresee, then mix_mode for every j; filter = predict_mode and
 * update_mode for every j, then judge.  A processor does so for the modes it
 * owns; l[j], nis[j], xw[j], Pw[j] of the others come to it by message; then,
 * if no mode has failed anywhere, it calls judge and weigh.  (It must own a
 * mode: update_mode opens judge and weigh.)
 * 0 <= j < M; scratch as above.  foresee computes c of all modes from mu of all
 * modes; mix_mode, predict_mode and update_mode leave their result in xw[j],
 * Pw[j], and l[j], nis[j], nu[j].  With a gate, a mode that rejects, and one
 * that is impossible (c_j = 0) and has no say, stays as predicted; judge, when
 * the measurement is accepted, updates it: so every processor does the same for
 * all modes, whoever owns them.  (Of nis[j] of the others, judge only asks
 * whether it is above the gate.)
 * judge returns JL_OK, JL_EORDER, or the code of an update that fails. */
void jl_imm_foresee(jl_imm *imm);
void jl_imm_mix_mode(jl_imm *imm, int j, jl_real *scratch);
int jl_imm_predict_mode(jl_imm *imm, int j, jl_real *scratch);
int jl_imm_update_mode(jl_imm *imm, int j, const jl_real *z,
                       jl_real *scratch);
int jl_imm_judge(jl_imm *imm, const jl_real *z, jl_real *scratch);

#ifdef __cplusplus
}
#endif
#endif
