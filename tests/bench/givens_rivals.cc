// Triangles by Eigen and by LAPACK.  What each computes of Q is left where it
// is; R is copied out.
#include "givens.h"

#include <eigen3/Eigen/Dense>

extern "C" void dgeqrf_(const int *m, const int *n, double *A, const int *lda,
                        double *tau, double *work, const int *lwork, int *info);

template <int rows, int cols>
using array = Eigen::Matrix<double, rows, cols, Eigen::ColMajor>;

template <int rows, int cols>
static array<rows, cols> by_columns(const double *A)
{
    return Eigen::Map<const Eigen::Matrix<double, rows, cols,
                                          Eigen::RowMajor>>(A);
}

template <int cols, class matrix>
static void copy_out(double *R, const matrix &A)
{
    Eigen::Map<Eigen::Matrix<double, cols, cols, Eigen::RowMajor>> to(R);

    to = A.template topRows<cols>().template triangularView<Eigen::Upper>();
}

template <int rows, int cols> static void eigen(double *R, const double *A)
{
    const Eigen::HouseholderQR<array<rows, cols>> qr(by_columns<rows, cols>(A));

    copy_out<cols>(R, qr.matrixQR());
}

template <int rows, int cols> static void lapack(double *R, const double *A)
{
    array<rows, cols> a = by_columns<rows, cols>(A);
    const int m = rows, n = cols, room = 64 * cols;
    double tau[cols], work[room];
    int info;

    dgeqrf_(&m, &n, a.data(), &m, tau, work, &room, &info);
    copy_out<cols>(R, a);
}

void givens_eigen_9_6(double *R, const double *A) { eigen<9, 6>(R, A); }
void givens_eigen_9_9(double *R, const double *A) { eigen<9, 9>(R, A); }
void givens_lapack_9_6(double *R, const double *A) { lapack<9, 6>(R, A); }
void givens_lapack_9_9(double *R, const double *A) { lapack<9, 9>(R, A); }
