// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/c/model.h>

#include <algorithm>
#include <limits>
#include <resonid/online/models/detail/regression.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/models/modes.hpp>

#include "adaptation.hpp"
#include "handle.hpp"

namespace resonid::c {

/// What a handle of the family `model` does, whichever method and order it has. Each type is compiled in a
/// source of its own, since these templates take long.
struct ModelOperations {
  std::uint32_t order;
  std::size_t size;
  expected<void, Error> (*build)(void* memory, std::uint32_t variant, const resonid_model_config&);
  void (*step)(void* handle, double ru, double u, double y);
  void (*miss)(void* handle, std::uint64_t count);
  void (*reset)(void* handle);
  void (*coefficients)(void* handle, double* b, double* a);
  void (*covariance)(void* handle, double* out);
  double (*lag_samples)(void* handle);
  std::size_t (*modes)(void* handle, bool anti, resonid_mode* out, std::size_t room);
  void (*describe)(void* handle, resonid_model_info& info);
};

/// An estimator, and what its modes need besides.
template <class Estimator>
struct HeldModel {
  Estimator estimator;
  double sample_rate_hz;
};

// The tables, ascending in order from the first one that there is.
std::span<const ModelOperations> arx_operations() noexcept;                       // from 1
std::span<const ModelOperations> output_error_operations() noexcept;              // from 1
std::span<const ModelOperations> closed_loop_output_error_operations() noexcept;  // from 1
std::span<const ModelOperations> instrumental_operations() noexcept;              // from 2

/// Make(config) gives the estimator; the operations follow from the concept DiscreteEstimator.
template <class Estimator, expected<Estimator, Error> (*Make)(const resonid_model_config&)>
class OperationsOf {
  static constexpr std::size_t kOrder = Estimator::kOrder;
  using Held = HeldModel<Estimator>;
  static Estimator& estimator(void* handle) noexcept { return content<Held>(handle).estimator; }

  static expected<void, Error> build(void* memory, std::uint32_t variant, const resonid_model_config& c) {
    auto made = Make(c);
    if (!made) {
      constexpr std::string_view kInner = "adaptation.";
      Phrase& field = made.error().field;
      if (field.view().starts_with(kInner)) field = field.view().substr(kInner.size());
      return unexpected<Error>(made.error());
    }
    place(memory, RESONID_FAMILY_MODEL, variant, Held{*made, c.sample_rate_hz});
    return {};
  }
  static void step(void* handle, double ru, double u, double y) { estimator(handle).step(ru, u, y); }
  static void miss(void* handle, std::uint64_t count) { estimator(handle).miss(count); }
  static void reset(void* handle) { estimator(handle).reset(); }
  static void coefficients(void* handle, double* b, double* a) {
    const auto model = estimator(handle).model();
    std::copy(model.b.begin(), model.b.end(), b);
    std::copy(model.a.begin(), model.a.end(), a);
  }
  static void covariance(void* handle, double* out) {
    const auto matrix = estimator(handle).covariance();
    for (int i = 0; i < matrix.rows(); ++i)
      for (int j = 0; j < matrix.cols(); ++j) *out++ = matrix(i, j);
  }
  static double lag_samples(void* handle) { return estimator(handle).lag_samples(); }
  static std::size_t modes(void* handle, bool anti, resonid_mode* out, std::size_t room) {
    const Held& held = content<Held>(handle);
    const online::SampledModes<kOrder> sampled(held.estimator.model(), held.sample_rate_hz);
    const auto covariance = held.estimator.covariance();
    const auto found = anti ? sampled.antiresonances(covariance) : sampled.resonances(covariance);
    for (std::size_t i = 0; i < std::min(found.count, room); ++i)
      out[i] = {found[i].frequency_hz, found[i].damping_ratio, found[i].std_hz};
    return found.count;
  }
  static void describe(void* handle, resonid_model_info& info) {
    const Estimator& e = estimator(handle);
    info.order = static_cast<std::uint32_t>(kOrder);
    info.ready = e.ready() ? 1 : 0;
    info.excited = e.excited() ? 1 : 0;
    info.samples = e.samples();
    info.skipped_samples = e.skipped_samples();
    info.residual = e.residual();
    if constexpr (requires { e.load_torque(); }) info.load_torque = finite_or_zero(e.load_torque());
    if constexpr (requires { e.coulomb_torque(); }) info.coulomb_torque = finite_or_zero(e.coulomb_torque());
  }
  /// Before there is a model, the torques are a quotient of zeros.
  static double finite_or_zero(double x) noexcept { return std::isfinite(x) ? x : 0.0; }

 public:
  static constexpr ModelOperations kTable{static_cast<std::uint32_t>(kOrder),
                                          handle_size<Held>(),
                                          &build,
                                          &step,
                                          &miss,
                                          &reset,
                                          &coefficients,
                                          &covariance,
                                          &lag_samples,
                                          &modes,
                                          &describe};
};

/// The fields that all methods but instrumental variables share.
inline expected<online::ModelEstimatorConfig, Error> common_config(const resonid_model_config& c) noexcept {
  const auto adapted = adaptation(c);
  if (!adapted) return unexpected<Error>(adapted.error());
  online::ModelEstimatorConfig common;
  common.sample_rate_hz = c.sample_rate_hz;
  common.delay_samples = c.delay_samples;
  common.start_b = array(c.start_b, c.order);
  common.start_a = array(c.start_a, c.order);
  common.fixed_integrator = c.fixed_integrator != 0;
  common.high_pass_hz = c.high_pass_hz;
  common.hold_below = c.hold_below;
  common.adaptation = *adapted;
  common.adaptation.scale = array(c.scale, 2 * std::size_t{c.order});
  return common;
}

}  // namespace resonid::c
