// SPDX-License-Identifier: MIT
#include <identification/measurement.hpp>

namespace resonid::identification::detail {

std::string name_of(Method method) {
  switch (method) {
    case Method::kalman:
      return "kalman";
    case Method::sliding_dft:
      return "sliding-dft";
    case Method::welch:
      return "welch";
    case Method::periodic:
      return "periodic";
    case Method::local_polynomial:
      return "local-polynomial";
    case Method::local_cubic:
      return "local-cubic";
    case Method::least_squares:
      return "least-squares";
    case Method::model:
      return "model";
    case Method::local_rational:
      return "local-rational";
    case Method::simulate_and_correct:
      return "simulate-and-correct";
    case Method::best_linear:
      return "best-linear";
    case Method::automatic:
      break;
  }
  return "auto";
}

std::string name_of(Approach approach) {
  switch (approach) {
    case Approach::direct:
      return "direct";
    case Approach::indirect:
      return "indirect";
    case Approach::joint:
      break;
  }
  return "joint";
}

}  // namespace resonid::identification::detail
