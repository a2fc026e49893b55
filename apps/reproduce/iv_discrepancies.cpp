// SPDX-License-Identifier: MIT
#include "reproduce/publication_iv.hpp"

namespace resonid::reproduction::iv {

std::vector<report::Discrepancy> discrepancies() {
  return {
      {"Eq. (3)", "F = K (r2 W2 - r1 W1) + D (r2 dW2/dt - r1 dW1/dt)",
       "F = K (r2 p2 - r1 p1) + D (r2 W2 - r1 W1), dp/dt = W",
       "A spring needs an elongation, a damper a velocity; as printed, the left side would have to be "
       "dF/dt."},
      {"Table 1, D of system A", "100 Ns/m; 120 in Table 2.1 and in Publication VI for the same belt",
       "100, and 120 beside it", "Nothing decides between them; every figure tells which it has."},
      {"Names A and B", "systems 2 and 1 here, 2 and 3 in Publication VI", "as in each publication",
       "The same letters stand for different machines."},
      {"Eqs. (5), (14)", "a constant state in every block", "one constant state that all lines share",
       "n - 1 of the n constant states are not observable: their modes at z = 1 never decay."},
      {"Eqs. (5), (7), state", "(re, im), the second called the first's derivative",
       "(Re p, -Im p) of signal = Re p",
       "With the printed rotation the phasor is x1 - j x2; read as x1 + j x2 every phase is mirrored. The "
       "second component is the quadrature, the derivative divided by the frequency."},
      {"Eq. (10)", "A P C^T", "A P C", "C is a column where eq. (4) has C^T as a row."},
      {"Eq. (11)", "I + C C^T P/(...)", "I - C C^T P/(...)",
       "A measurement reduces the covariance. Without process noise the gain then dies out, which is why "
       "eq. (12) fixes it."},
      {"Eq. (15)", "C^T = [1 0 1 0 ...]", "[1 0 1 0 ... 1], the constant state last",
       "It belongs to blocks of two states, eq. (5) has three."},
      {"Eq. (16)", "sqrt(re + im)", "sqrt(re^2 + im^2)",
       "The squares are lost; the source says so elsewhere."},
      {"Eq. (17)", "disturbance of 0.25, no phases and no sample time",
       "standard deviation 0.25 and three sines of 0.25 with phase 0; 1 ms", "Not stated."},
      {"Eq. (18), text", "frequencies from the grid 2 pi l/Np, resolution 3 Hz",
       "the grid l/(Np Ts) = 0.1 Hz, period 10 s",
       "The sample time is missing. 2.9, 5.9 ... 23.9 Hz are no multiples of 3 Hz: they repeat together "
       "after 10 s."},
      {"Text on figure 2 b", "a larger lambda: larger error, faster tracking",
       "larger lambda: always less noise; faster up to an optimum, slower beyond",
       "The noise's variance is r/(2 lambda + c'c) exactly. The text below eq. (12) says the opposite of "
       "the one on the figure, and is right about the error."},
      {"Eq. (19)", "|G(jw)^2| under the roots", "|G(jw)|^2",
       "The bar is misplaced. For a scalar response both are the same number, for a matrix they are not."},
      {"Eq. (20)", "the largest distance, 0 <= w <= pi fs", "the pointwise distance at the lines",
       "The maximum is Vinnicombe's gap only where the winding-number condition holds; from lines it cannot "
       "be told."},
      {"Section 4.1, PRBS", "'7-register', +-2.3 Nm, no clock and no sample time",
       "bits held for 8 samples of 2 ms",
       "If clocked at the 2 ms of Publication VI the lines would be 3.94 Hz apart and could not show a "
       "resonance at 11 or 15 Hz as figures 4 and 8 do."},
      {"Sections 4.1, 4.3, loop", "'low bandwidth PI', no gains, no sample time, no delay",
       "2 ms, C = 1.036 (1 + Ts/0.147 z/(z-1)) Nms/rad for A and for B, 4 ms delay in the measured velocity",
       "The figures that Publication VI has on the same bench, 2.7 Hz and 63.5 degrees with the delay, fix "
       "the controller on system A. The source speaks of one controller for both machines; on B it gives "
       "2.63 Hz and 63.2 degrees (table of the loops)."},
      {"Figures 4 to 9, noise", "measured, with noise and eccentricity that are not quantified",
       "white noise of 0.1 rad/s on the velocity, and runs without",
       "The level of Publication VI's simulations."},
  };
}

}  // namespace resonid::reproduction::iv
