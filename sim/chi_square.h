/* The chi-square distribution, of the squared length of m standard normals. */
#ifndef SIM_CHI_SQUARE_H
#define SIM_CHI_SQUARE_H

/* The probability that it exceeds x > 0. */
double chi_square_tail(double x, int m);

/* What it does not exceed with probability p, 0 < p < 1: above 0, to some 12
 * digits, and the same on machines whose C libraries differ in a last one. */
double chi_square_quantile(double p, int m);

#endif
