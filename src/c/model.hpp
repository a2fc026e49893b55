// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/c/detail/models.h>

#include <algorithm>
#include <resonid/online/models/detail/regression.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/models/modes.hpp>

#include "adaptation.hpp"
#include "handle.hpp"

namespace resonid::c {

/// What a handle of the family `model` does, whichever method and order it has. Each type is compiled in a
/// source of its own, since these templates take long.
struct ModelOperations {
  Operations common;
  std::uint32_t order;
  expected<void> (*build)(void* memory, std::uint32_t variant, const resonid_model_settings&) noexcept;
  std::size_t (*modes)(const void* handle, bool anti, resonid_mode* out, std::size_t room) noexcept;
};

/// An estimator, and what its modes need besides.
template <class Estimator>
struct StoredModel {
  Estimator estimator;
  double sample_rate_hz;

  void reset() noexcept { estimator.reset(); }
  void miss(std::uint64_t count) noexcept { estimator.miss(count); }
  [[nodiscard]] bool intact() const noexcept { return estimator.intact(); }
};

// The tables, ascending in order from the first one that there is.
std::span<const ModelOperations> arx_operations() noexcept;                       // from 1
std::span<const ModelOperations> output_error_operations() noexcept;              // from 1
std::span<const ModelOperations> closed_loop_output_error_operations() noexcept;  // from 1
std::span<const ModelOperations> instrumental_operations() noexcept;              // from 2

/// What all types of model do alike, from the concept DiscreteEstimator.
struct ModelDescription {
  using Results = resonid_model_results;

  template <class E>
  static void step(StoredModel<E>& stored, double ru, double u, double y) noexcept {
    stored.estimator.step(ru, u, y);
  }
  template <class Stored>
  static constexpr std::uint32_t kParameters = 2 * decltype(Stored::estimator)::kOrder;
  template <class E>
  static void parameters(const StoredModel<E>& stored, double* out) noexcept {
    const auto model = stored.estimator.model();
    std::copy(model.a.begin(), model.a.end(), std::copy(model.b.begin(), model.b.end(), out));
  }
  template <class E>
  static void covariance(const StoredModel<E>& stored, double* out) noexcept {
    const auto matrix = stored.estimator.covariance();
    for (int i = 0; i < matrix.rows(); ++i)
      for (int j = 0; j < matrix.cols(); ++j) *out++ = matrix(i, j);
  }
  template <class E>
  static double lag_samples(const StoredModel<E>& stored) noexcept {
    return stored.estimator.lag_samples();
  }
  template <class E>
  static void results(const StoredModel<E>& stored, Results& r) noexcept {
    const E& e = stored.estimator;
    r.samples = e.samples();
    r.skipped_samples = e.skipped_samples();
    r.order = static_cast<std::uint32_t>(E::kOrder);
    r.ready = e.ready() ? 1 : 0;
    r.excited = e.excited() ? 1 : 0;
    r.residual = e.residual();
    // Before there is a model, the torques are a quotient of zeros.
    const auto finite_or_zero = [](double x) { return std::isfinite(x) ? x : 0.0; };
    if constexpr (requires { e.load_torque(); }) r.load_torque = finite_or_zero(e.load_torque());
    if constexpr (requires { e.coulomb_torque(); }) r.coulomb_torque = finite_or_zero(e.coulomb_torque());
  }
};

/// Make(settings) gives the estimator.
template <class Estimator, expected<Estimator> (*Make)(const resonid_model_settings&) noexcept>
class ModelOperationsOf {
  using Stored = StoredModel<Estimator>;

  static expected<void> build(void* memory, std::uint32_t variant, const resonid_model_settings& s) noexcept {
    const auto made = Make(s);
    if (!made) {
      constexpr std::string_view kInner = "adaptation.";
      Error error = made.error();
      const std::string_view field = error.field;  // of a literal
      if (field.substr(0, kInner.size()) == kInner) error.field = field.substr(kInner.size());
      return unexpected<Error>(error);
    }
    place(memory, s.head.kind, variant, Stored{*made, s.sample_rate_hz});
    return {};
  }
  static std::size_t modes(const void* handle, bool anti, resonid_mode* out, std::size_t room) noexcept {
    const Stored& stored = content<Stored>(handle);
    const online::SampledModes<Estimator::kOrder> sampled(stored.estimator.model(), stored.sample_rate_hz);
    const auto covariance = stored.estimator.covariance();
    const auto found = anti ? sampled.antiresonances(covariance) : sampled.resonances(covariance);
    for (std::size_t i = 0; i < std::min(found.count, room); ++i)
      out[i] = {found[i].frequency_hz, found[i].damping_ratio, found[i].std_hz};
    return found.count;
  }

 public:
  static constexpr ModelOperations kTable{operations_for<ModelDescription, Stored>(),
                                          static_cast<std::uint32_t>(Estimator::kOrder), &build, &modes};
};

/// The fields that all methods but instrumental variables share.
inline expected<online::ModelEstimatorConfig> common_config(const resonid_model_settings& s) noexcept {
  const auto adapted = adaptation(s);
  if (!adapted) return unexpected<Error>(adapted.error());
  online::ModelEstimatorConfig common;
  common.sample_rate_hz = s.sample_rate_hz;
  common.delay_samples = s.delay_samples;
  common.start_b = array(s.start_b, s.order);
  common.start_a = array(s.start_a, s.order);
  common.fixed_integrator = s.fixed_integrator != 0;
  common.high_pass_hz = s.high_pass_hz;
  common.freeze_below = s.freeze_below;
  common.adaptation = *adapted;
  common.adaptation.scale = array(s.scale, 2 * std::size_t{s.order});
  return common;
}

}  // namespace resonid::c
