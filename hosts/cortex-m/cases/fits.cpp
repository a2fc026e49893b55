// SPDX-License-Identifier: MIT
#include <cmath>
#include <complex>
#include <new>
#include <resonid/recursive/instrumental_variables.hpp>
#include <resonid/recursive/recursive_response_fit.hpp>
#include <resonid/recursive/response_fit.hpp>

#include "../define_case.hpp"
#include "../record.hpp"
#include "cases.hpp"

using namespace resonid::recursive;

namespace {

constexpr std::array<double, 21> lines() {
  std::array<double, 21> hz{};
  for (std::size_t i = 0; i < hz.size(); ++i) hz[i] = 10.0 * drive::kLineSpacingHz * static_cast<double>(i + 1);
  return hz;
}

template <class Made>
void model(Output& out, Made& estimator) {
  const auto m = estimator->model();
  out.floats("b", m.b);
  out.floats("a", m.a);
}

struct InstrumentalVariablesCase {
  using Estimator = InstrumentalVariables<float, 3>;
  static inline Storage<Estimator> iv;

  static bool create() {
    InstrumentalVariablesConfig<3> c;
    c.start.b = {0.05, -0.07, 0.06};
    c.start.a = {-2.34, 2.25, -0.91};
    c.controller_numerator = drive::kControllerNumerator;
    c.controller_denominator = drive::kControllerDenominator;
    return iv.hold(Estimator::create(c));
  }
  static void step(const Sample& s) { iv->step(s.ru, s.u, s.y); }
  static void report(Output& out) { model(out, iv); }
};

/// Response of a model that differs from sample to sample, as a tracker's would.
void fill(std::span<std::complex<float>> response, float shift) {
  for (std::size_t i = 0; i < response.size(); ++i) {
    const float f = static_cast<float>(i) * 0.1F + 0.1F;
    response[i] = std::complex<float>(1.0F / f + shift, -f) * 0.1F;
  }
}

struct ResponseFitCase {
  using Estimator = ResponseFit<float, 3, 21>;
  static inline Storage<Estimator> fit;
  static inline std::array<std::complex<float>, 21> response;

  static bool create() {
    const auto hz = lines();
    return fit.hold(Estimator::create({.sample_rate_hz = drive::kSampleRateHz, .frequency_hz = hz}));
  }
  static void step(const Sample& s) {
    fill(response, s.y);
    fit->step(response);
  }
  static void report(Output& out) { model(out, fit); }
};

struct RecursiveResponseFitCase {
  using Estimator = RecursiveResponseFit<float, 3, 21>;
  static inline Storage<Estimator> fit;

  static bool create() {
    const auto hz = lines();
    return fit.hold(Estimator::create({.sample_rate_hz = drive::kSampleRateHz, .frequency_hz = hz}));
  }
  static void step(const Sample& s) { fit->step({s.u, s.y}); }
  static void report(Output& out) { model(out, fit); }
};

}  // namespace

const Case instrumental_variables_3 =
    case_of<InstrumentalVariablesCase>("instrumental_variables_3", Injection::prbs);
const Case response_fit_3_21 = case_of<ResponseFitCase>("response_fit_3_21", Injection::prbs);
const Case recursive_response_fit_3_21 =
    case_of<RecursiveResponseFitCase>("recursive_response_fit_3_21", Injection::prbs);
