/* Systems that are linear in their states if their parameters are known: models
 * for the MEKF and its rival (jumplink/mekf.h). */
#ifndef SIM_MEKF_ZOO_H
#define SIM_MEKF_ZOO_H

#include "jumplink/mekf.h"

enum {                          /* the most of any model */
    ZOO_STATES = 5,             /* n + m                                    */
    ZOO_NOISES = 3,             /* p1 + p2                                  */
    ZOO_R = 4                   /* of spring2, which may have fewer         */
};

/* The numbers of a model: each needs only those that it names below. */
struct mekf_zoo {
    int r;
    jl_real T, d, C[ZOO_R * 2];
    jl_real A0[9], A1[9], A2[9], C0[6], C1[6], C2[6], B1[6], B2[4], B3[2];
    jl_real a1, a2, b1, b2, g;
};

/* A model by its name, with all its derivatives:
 *     ar1      n 1, m 1, r 1   f = y;  c = 1;  G1 = 1
 *     spring2  n 2, m 1, r 1-4  f = [1 T; -T y, 1 - T d];  c = C [r,2];
 *                              G1 = [0; 1]
 *     ct4pos   n 4, m 1, r 2   x = px vx py vy, turned by y T: coordinated
 *                              turn of the rate y;  c picks px, py;  G1 =
 *                              [T^2/2 0; T 0; 0 T^2/2; 0 T]
 *     ct4rdc   n 4, m 1, r 3   the same, z = range and direction cosines
 *     gen32    n 3, m 2, r 2   f = A0 + y1 A1 + sin(y2) A2,  c = C0 + y1 C1 +
 *                              cos(x1) C2,  h = [a1 y1 + b1 sin x1, a2 y2 + b2
 *                              x2 cos y1],  G1 = (1 + g sin x1) B1,  G2 =
 *                              (1 + g cos y1) B2,  G3 = B3
 * h = y, G2 = 0, G3 = I where nothing is said.
 * Returns 0, or -1 (no such model; r of spring2): *model is untouched then.
 * *zoo outlives the model. */
int mekf_zoo_model(jl_mekf_model *model, const char *name,
                   struct mekf_zoo *zoo);

#endif
