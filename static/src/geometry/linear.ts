/** Small symmetric systems of equations: the normal equations of a fit with six or eight unknowns. */

/**
 * Solves `A x = b` for a symmetric positive definite A (n x n, row by row) by Cholesky's method;
 * null where A is not positive definite.
 */
export function solveSymmetric(A: Float64Array, b: Float64Array, n: number): Float64Array | null {
  const L = new Float64Array(n * n);
  for (let row = 0; row < n; row += 1) {
    for (let column = 0; column <= row; column += 1) {
      let sum = at(A, row * n + column);
      for (let k = 0; k < column; k += 1) {
        sum -= at(L, row * n + k) * at(L, column * n + k);
      }
      if (row === column) {
        if (!(sum > 0)) {
          return null;
        }
        L[row * n + row] = Math.sqrt(sum);
      } else {
        L[row * n + column] = sum / at(L, column * n + column);
      }
    }
  }
  const x = new Float64Array(b);
  for (let row = 0; row < n; row += 1) {
    for (let k = 0; k < row; k += 1) {
      x[row] = at(x, row) - at(L, row * n + k) * at(x, k);
    }
    x[row] = at(x, row) / at(L, row * n + row);
  }
  for (let row = n - 1; row >= 0; row -= 1) {
    for (let k = row + 1; k < n; k += 1) {
      x[row] = at(x, row) - at(L, k * n + row) * at(x, k);
    }
    x[row] = at(x, row) / at(L, row * n + row);
  }
  return x;
}

/** An element that is known to be there. */
export function at(values: Float64Array, index: number): number {
  return values[index] ?? Number.NaN;
}
