// Eigen with all sizes known to the compiler, as somebody who knows Eigen
// would write it.  Of several ways to write a part here is the one that was
// fastest with Eigen 3.4 and gcc 12: the closed inverse of S (LLT costs 25% to
// 80% more a step), the sums over modes in loops (products of matrices with a
// column a mode 4% to 20% more, but for two modes).
#include "sizes.h"

#include <array>

#include <eigen3/Eigen/Dense>

namespace {

const double log_2pi = 1.8378770664093454836;

template <int r, int c> using Matrix = Eigen::Matrix<double, r, c>;
template <int r> using Vector = Eigen::Matrix<double, r, 1>;

// Row-major data from outside.
template <int r, int c> auto given(const double *data)
{
    const int order = c == 1 ? Eigen::ColMajor : Eigen::RowMajor;
    return Eigen::Map<const Eigen::Matrix<double, r, c, order>>(data);
}

template <int n, int m> struct Mode {
    Matrix<n, n> F, W;
    Vector<n> u;
    Matrix<m, n> H;
    Matrix<m, m> R;

    Mode() = default;
    Mode(const sizes_model &model, int j)
        : F(given<n, n>(model.F + j * n * n)),
          W(given<n, n>(model.W + j * n * n)),
          u(given<n, 1>(model.u + j * n)),
          H(given<m, n>(model.H + j * m * n)),
          R(given<m, m>(model.R + j * m * m))
    {
    }
};

// Predict and update from x0, P0, which may be x, P.  Returns the
// log-likelihood.
template <int n, int m, sizes_form form>
inline double filter(Vector<n> &x, Matrix<n, n> &P, const Vector<n> &x0,
                     const Matrix<n, n> &P0, const Mode<n, m> &mode,
                     const Vector<m> &z)
{
    Vector<n> xp = mode.u;
    xp.noalias() += mode.F * x0;
    Matrix<n, n> FP;
    FP.noalias() = mode.F * P0;
    Matrix<n, n> Pp = mode.W;
    Pp.noalias() += FP * mode.F.transpose();

    Matrix<n, m> PHt;
    PHt.noalias() = Pp * mode.H.transpose();
    Matrix<m, m> S = mode.R;
    S.noalias() += mode.H * PHt;
    Vector<m> nu = z;
    nu.noalias() -= mode.H * xp;

    // Up to 4 x 4 Eigen has the inverse and the determinant in closed form.
    static_assert(m <= 4, "closed form");
    const Matrix<m, m> inverse = S.inverse();
    Matrix<n, m> K;
    K.noalias() = PHt * inverse;
    x = xp;
    x.noalias() += K * nu;
    if (form == JOSEPH) {
        Matrix<n, n> A = Matrix<n, n>::Identity();
        A.noalias() -= K * mode.H;
        Matrix<n, n> AP;
        AP.noalias() = A * Pp;
        Matrix<n, m> KR;
        KR.noalias() = K * mode.R;
        P.noalias() = AP * A.transpose();
        P.noalias() += KR * K.transpose();
    } else {
        P = Pp;
        P.noalias() -= K * PHt.transpose();
        // Left to itself the rounding that is not symmetric grows, until
        // after 50 steps ten digits are gone.
        P.template triangularView<Eigen::StrictlyUpper>() = P.transpose();
    }
    return -0.5 * (m * log_2pi + std::log(S.determinant())
                   + nu.dot(inverse * nu));
}

template <int n, int m, sizes_form form> struct Kalman : sizes_filter {
    const sizes_model &model;
    Mode<n, m> mode;
    Vector<n> x;
    Matrix<n, n> P;

    explicit Kalman(const sizes_model &given_model)
        : model(given_model), mode(given_model, 0)
    {
        sizes_filter::start = [](sizes_filter *f) { of(f)->start(); };
        sizes_filter::step = [](sizes_filter *f, const double *z) {
            return of(f)->step(given<m, 1>(z));
        };
        sizes_filter::estimate = [](sizes_filter *f) {
            return sizes_estimate{ of(f)->x.data(), of(f)->P.data(),
                                   of(f)->model.mu };
        };
        start();
    }

    static Kalman *of(sizes_filter *f) { return static_cast<Kalman *>(f); }

    void start()
    {
        x = given<n, 1>(model.x);
        P = given<n, n>(model.P);
    }

    double step(const Vector<m> &z)
    {
        return filter<n, m, form>(x, P, x, P, mode, z);
    }
};

template <int M, int n, int m, sizes_form form> struct Imm : sizes_filter {
    typedef std::array<Vector<n>, M> States;
    typedef std::array<Matrix<n, n>, M> Covariances;

    const sizes_model &model;
    std::array<Mode<n, m>, M> modes;
    Matrix<M, M> Pi;
    States x, x0;
    Covariances P, P0;
    Vector<M> mu, logmu;
    Vector<n> xhat;
    Matrix<n, n> Phat;

    explicit Imm(const sizes_model &given_model)
        : model(given_model), Pi(given<M, M>(given_model.Pi))
    {
        for (int j = 0; j < M; j++)
            modes[j] = Mode<n, m>(model, j);
        sizes_filter::start = [](sizes_filter *f) { of(f)->start(); };
        sizes_filter::step = [](sizes_filter *f, const double *z) {
            return of(f)->step(given<m, 1>(z));
        };
        sizes_filter::estimate = [](sizes_filter *f) {
            return sizes_estimate{ of(f)->xhat.data(), of(f)->Phat.data(),
                                   of(f)->mu.data() };
        };
        start();
    }

    static Imm *of(sizes_filter *f) { return static_cast<Imm *>(f); }

    void start()
    {
        for (int j = 0; j < M; j++) {
            x[j] = given<n, 1>(model.x + j * n);
            P[j] = given<n, n>(model.P + j * n * n);
        }
        mu = given<M, 1>(model.mu);
        logmu = mu.array().log();
    }

    // mean and cov of the mixture of the modes with weights w
    void pool(Vector<n> &mean, Matrix<n, n> &cov, const Vector<M> &w) const
    {
        Vector<n> sum = w(0) * x[0];
        for (int i = 1; i < M; i++)
            sum += w(i) * x[i];
        Matrix<n, n> spread = w(0) * P[0];
        for (int i = 1; i < M; i++)
            spread += w(i) * P[i];
        if (M == 2) {
            Matrix<n, M> d, wd;
            for (int i = 0; i < M; i++) {
                d.col(i) = x[i] - sum;
                wd.col(i) = w(i) * d.col(i);
            }
            cov = spread + wd.lazyProduct(d.transpose());
        } else {
            for (int i = 0; i < M; i++) {
                const Vector<n> d = x[i] - sum, wd = w(i) * d;
                for (int k = 0; k < n; k++)
                    spread.col(k) += wd * d(k);
            }
            cov = spread;
        }
        mean = sum;
    }

    double step(const Vector<m> &z)
    {
        Vector<M> c, l;
        c = Pi.transpose().lazyProduct(mu);
        for (int j = 0; j < M; j++)
            pool(x0[j], P0[j], Pi.col(j).cwiseProduct(mu) / c(j));
        for (int j = 0; j < M; j++)
            l(j) = filter<n, m, form>(x[j], P[j], x0[j], P0[j], modes[j], z);
        for (int j = 0; j < M; j++)
            logmu(j) = std::log(c(j)) + l(j);
        const double most = logmu.maxCoeff();
        for (int j = 0; j < M; j++)
            mu(j) = std::exp(logmu(j) - most);
        const double sum = mu.sum();
        const double loglik = most + std::log(sum);
        mu /= sum;
        logmu.array() -= loglik;
        pool(xhat, Phat, mu);
        return loglik;
    }
};

template <sizes_form form> sizes_filter *make(const sizes_model &model)
{
    auto is = [&model](int kalman, int M, int n, int m) {
        return model.kalman == kalman && model.M == M && model.n == n
            && model.m == m;
    };
    if (is(1, 1, 4, 2)) return new Kalman<4, 2, form>(model);
    if (is(1, 1, 6, 3)) return new Kalman<6, 3, form>(model);
    if (is(0, 2, 3, 1)) return new Imm<2, 3, 1, form>(model);
    if (is(0, 3, 4, 2)) return new Imm<3, 4, 2, form>(model);
    if (is(0, 12, 6, 3)) return new Imm<12, 6, 3, form>(model);
    return nullptr;
}

} // namespace

sizes_filter *sizes_eigen(const sizes_model *model, sizes_form form)
{
    if (form == SQRT)
        return nullptr;
    return form == JOSEPH ? make<JOSEPH>(*model) : make<STANDARD>(*model);
}
