// SPDX-License-Identifier: MIT
#include <cmath>
#include <complex>
#include <new>
#include <resonid/online/models/detail/response_fit.hpp>
#include <resonid/online/models/instrumental_variables.hpp>
#include <resonid/online/models/recursive_response_fit.hpp>

#include "../define_case.hpp"
#include "../record.hpp"
#include "cases.hpp"

using namespace resonid::online;

namespace {

constexpr std::array<double, 21> lines() {
  std::array<double, 21> hz{};
  for (std::size_t i = 0; i < hz.size(); ++i)
    hz[i] = 10.0 * drive::kLineSpacingHz * static_cast<double>(i + 1);
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
    c.start.b = {0.15, -0.13, 0.13};
    c.start.a = {-1.0, 0.84, -0.84};
    c.controller_numerator = drive::kControllerNumerator;
    c.controller_denominator = drive::kControllerDenominator;
    return iv.hold(Estimator::create(c));
  }
  static void step(const Sample& s) { iv->step(s.ru, s.u, s.y); }
  static void report(Output& out) { model(out, iv); }
};

/// A response at the lines that differs from sample to sample, as a tracker's would: 1/(jw) and jw/(w0^2 -
/// w^2 + jdw).
std::complex<float> response_at(std::size_t line, float change) {
  const float f = static_cast<float>(line + 1) / 21.0F;
  const float stiff = 0.36F + 0.01F * change - f * f, damping = 0.05F * f;
  const float size = stiff * stiff + damping * damping;
  return {0.1F * f * damping / size, 0.1F * f * stiff / size - 0.02F / f};
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
    for (std::size_t i = 0; i < response.size(); ++i) response[i] = response_at(i, s.y);
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
  static void step(const Sample& s) { fit->step(response_at(fit->next_line(), s.y)); }
  static void report(Output& out) { model(out, fit); }
};

}  // namespace

const Case instrumental_variables_3 =
    case_of<InstrumentalVariablesCase>("instrumental_variables_3", Injection::prbs);
const Case response_fit_3_21 = case_of<ResponseFitCase>("response_fit_3_21", Injection::prbs);
const Case recursive_response_fit_3_21 =
    case_of<RecursiveResponseFitCase>("recursive_response_fit_3_21", Injection::prbs);
