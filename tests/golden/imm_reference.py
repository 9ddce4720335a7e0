#!/usr/bin/env python3
"""The IMM in 60 digits, by the textbook: imm_reference.py CASE...

Makes expected.csv of each folder CASE from its model.json and z.csv.  Plain
covariances, general mixing, an update by the inverse of S: nothing that the
library does.  Slow; made to be believed."""
import csv
import json
import os
import sys
from decimal import Decimal, getcontext

getcontext().prec = 60
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459")
NONE = Decimal("-Infinity")             # log 0


def exact(value):
    """A JSON value with its numbers as the doubles they are."""
    if isinstance(value, list):
        return [exact(v) for v in value]
    return Decimal(float(value))


def mul(A, B):
    return [[sum(a * b for a, b in zip(row, column)) for column in zip(*B)]
            for row in A]


def add(A, B):
    return [[a + b for a, b in zip(ra, rb)] for ra, rb in zip(A, B)]


def turned(A):
    return [list(column) for column in zip(*A)]


def column(v):
    return [[a] for a in v]


def inverse(A):
    """The inverse, and the determinant, by elimination."""
    n = len(A)
    W = [row[:] + [Decimal(i == j) for j in range(n)]
         for i, row in enumerate(A)]
    det = Decimal(1)
    for k in range(n):
        det *= W[k][k]
        W[k] = [w / W[k][k] for w in W[k]]
        for i in range(n):
            if i != k:
                f = W[i][k]
                W[i] = [a - f * b for a, b in zip(W[i], W[k])]
    return [row[n:] for row in W], det


def pool(w, xs, Ps):
    """Mean and covariance of a mixture."""
    n = len(xs[0])
    mean = [sum(wi * x[a] for wi, x in zip(w, xs)) for a in range(n)]
    cov = [[Decimal(0)] * n for _ in range(n)]
    for wi, x, P in zip(w, xs, Ps):
        d = [a - b for a, b in zip(x, mean)]
        for a in range(n):
            for b in range(n):
                cov[a][b] += wi * (P[a][b] + d[a] * d[b])
    return mean, cov


def log_sum_exp(logs):
    top = max(logs)
    return NONE if top == NONE else top + sum((v - top).exp()
                                              for v in logs).ln()


def kalman(mode, x, P, z):
    """Predict and update; and log N(nu; 0, S)."""
    F, G, H = mode["Phi"], mode["Gamma"], mode["H"]
    x = [a[0] + b[0] for a, b in zip(mul(F, column(x)),
                                     mul(G, column(mode["w_bar"])))]
    P = add(mul(mul(F, P), turned(F)), mul(mul(G, mode["Q"]), turned(G)))
    S = add(mul(mul(H, P), turned(H)), mode["R"])
    inv, det = inverse(S)
    nu = [a - b[0] for a, b in zip(z, mul(H, column(x)))]
    K = mul(mul(P, turned(H)), inv)
    x = [a + b[0] for a, b in zip(x, mul(K, column(nu)))]
    P = add(P, [[-v for v in row] for row in mul(mul(K, S), turned(K))])
    nis = mul(mul([nu], inv), column(nu))[0][0]
    return x, P, -(len(z) * (2 * PI).ln() + det.ln() + nis) / 2


def run(model, rows):
    modes = [{"w_bar": [0] * len(m["Q"])} | m for m in model["modes"]]
    modes = [{k: exact(v) for k, v in m.items() if k != "name"} for m in modes]
    Pi, M = exact(model["Pi"]), len(modes)
    x, P = [m["x0"] for m in modes], [m["P0"] for m in modes]
    logmu = [m.ln() if m else NONE for m in exact(model["mu0"])]
    for z in rows:
        logc, mixed = [], []
        for j in range(M):
            logs = [Pi[i][j].ln() + logmu[i] if Pi[i][j] else NONE
                    for i in range(M)]
            logc.append(log_sum_exp(logs))
            mixed.append((x[j], P[j]) if logc[j] == NONE else
                         pool([(v - logc[j]).exp() for v in logs], x, P))
        updated = [kalman(m, *xP, z) for m, xP in zip(modes, mixed)]
        x, P = [u[0] for u in updated], [u[1] for u in updated]
        logmu = [c + u[2] for c, u in zip(logc, updated)]
        loglik = log_sum_exp(logmu)
        logmu = [v - loglik for v in logmu]
        mu = [v.exp() for v in logmu]
        xhat, Phat = pool(mu, x, P)
        yield xhat + [Phat[a][b] for a in range(len(xhat))
                      for b in range(a, len(xhat))] + mu + [loglik]


def main(folders):
    for folder in folders:
        with open(os.path.join(folder, "model.json")) as file:
            model = json.load(file)
        with open(os.path.join(folder, "z.csv")) as file:
            rows = [exact(row[1:]) for row in list(csv.reader(file))[1:]]
        n, M = model["n"], len(model["modes"])
        head = (["k"] + [f"x{a}" for a in range(n)]
                + [f"P{a}{b}" for a in range(n) for b in range(a, n)]
                + [f"mu{j}" for j in range(M)] + ["loglik"])
        with open(os.path.join(folder, "expected.csv"), "w") as out:
            print(",".join(head), file=out)
            for k, row in enumerate(run(model, rows), 1):
                print(k, *("%.17g" % v for v in row), sep=",", file=out)


main(sys.argv[1:])
