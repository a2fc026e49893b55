// SPDX-License-Identifier: MIT
#include <resonid/c/rls.h>

#include <array>
#include <resonid/online/models/rls.hpp>
#include <utility>

#include "adaptation.hpp"
#include "handle.hpp"

namespace resonid::c {
namespace {

constexpr std::size_t kMost = RESONID_RLS_MAX_PARAMETERS;

/// One to kMost parameters in double, then in single precision.
template <class Numbers>
struct RlsVariants;
template <std::size_t... I>
struct RlsVariants<std::index_sequence<I...>> {
  using Type = Variants<RESONID_FAMILY_RLS, online::RecursiveLeastSquares<double, I + 1>...,
                        online::RecursiveLeastSquares<float, I + 1>...>;
};

struct Rlss : RlsVariants<std::make_index_sequence<kMost>>::Type {
  using Config = resonid_rls_config;
  using Handle = resonid_rls;

  static Config defaults() noexcept {
    const online::RecursiveLeastSquaresConfig r;
    resonid_rls_config c{};
    c.forgetting = static_cast<std::uint32_t>(r.forgetting);
    c.start_variance = r.start_variance;
    c.factor = r.factor;
    c.smallest_factor = r.smallest_factor;
    c.noise_variance = r.noise_variance;
    c.largest_variance = r.largest_variance;
    c.smallest_variance = r.smallest_variance;
    return c;
  }
  static Config defaults_for(const Config*) noexcept { return defaults(); }
  static expected<std::uint32_t, Error> variant(const Config& c) noexcept {
    if (c.precision > RESONID_FLOAT) return refuse("precision", "must be one of its constants", c.precision);
    if (c.parameters < 1 || c.parameters > kMost)
      return refuse("parameters", "must be 1 ... RESONID_RLS_MAX_PARAMETERS", c.parameters);
    return static_cast<std::uint32_t>(c.precision * kMost + c.parameters - 1);
  }
  static std::size_t size(std::uint32_t variant) noexcept { return kSize[variant]; }
  static expected<void, Error> build(void* memory, std::uint32_t variant, const Config& c) noexcept {
    std::array<bool, kMost> held{};
    const auto given = array(c.held, c.parameters);
    for (std::size_t i = 0; i < given.size(); ++i) held[i] = given[i] != 0;
    auto config = adaptation(c);
    if (!config) return unexpected<Error>(config.error());
    config->start = array(c.start, c.parameters);
    config->scale = array(c.scale, c.parameters);
    config->held = std::span(held).first(given.size());
    return build(memory, variant, *config, std::make_index_sequence<kMost>());
  }

 private:
  using Make = expected<void, Error> (*)(void*, std::uint32_t, const online::RecursiveLeastSquaresConfig&);
  template <class T>
  static expected<void, Error> make(void* memory, std::uint32_t variant,
                                    const online::RecursiveLeastSquaresConfig& config) noexcept {
    const auto made = T::create(config);
    if (!made) return unexpected<Error>(made.error());
    place(memory, kFamily, variant, *made);
    return {};
  }
  template <std::size_t... I>
  static expected<void, Error> build(void* memory, std::uint32_t variant,
                                     const online::RecursiveLeastSquaresConfig& config,
                                     std::index_sequence<I...>) noexcept {
    static constexpr Make kMake[] = {&make<online::RecursiveLeastSquares<double, I + 1>>...,
                                     &make<online::RecursiveLeastSquares<float, I + 1>>...};
    return kMake[variant](memory, variant, config);
  }
};
static_assert(Rlss::kSize[kMost - 1] <= RESONID_RLS_SIZE);

template <class Estimator>
constexpr std::size_t parameters_of(const Estimator&) noexcept {
  return Estimator::kParameters;
}

}  // namespace
}  // namespace resonid::c

using resonid::c::Rlss;

resonid_status resonid_rls_defaults(resonid_rls_config* config, size_t struct_size) noexcept {
  return resonid::c::give_defaults(Rlss::defaults(), config, struct_size);
}
size_t resonid_rls_size(const resonid_rls_config* config) noexcept {
  return resonid::c::size_of<Rlss>(config);
}
resonid_status resonid_rls_init(void* memory, size_t size, const resonid_rls_config* config,
                                resonid_rls** handle, resonid_error* error) noexcept {
  return resonid::c::init<Rlss>(memory, size, config, handle, error);
}
resonid_status resonid_rls_create(const resonid_rls_config* config, resonid_rls** handle,
                                  resonid_error* error) noexcept {
  return resonid::c::create<Rlss>(config, handle, error);
}
resonid_status resonid_rls_step(resonid_rls* handle, const double* regressor, double value,
                                double weight) noexcept {
  if (regressor == nullptr) return RESONID_ERROR_NULL;
  return Rlss::visit(handle, [&](auto& rls) {
    using Estimator = std::remove_reference_t<decltype(rls)>;
    using Real = typename Estimator::Scalar;
    typename Estimator::Vector f;
    for (std::size_t i = 0; i < f.size(); ++i) f[i] = static_cast<Real>(regressor[i]);
    rls.step(f, static_cast<Real>(value), static_cast<Real>(weight));
  });
}
resonid_status resonid_rls_miss(resonid_rls* handle, uint64_t count) noexcept {
  return Rlss::visit(handle, [&](auto& rls) { rls.miss(count); });
}
resonid_status resonid_rls_reset(resonid_rls* handle) noexcept {
  return Rlss::visit(handle, [](auto& rls) { rls.reset(); });
}
resonid_status resonid_rls_parameters(const resonid_rls* handle, double* parameters, size_t count) noexcept {
  return Rlss::visit(handle, [&](const auto& rls) -> resonid_status {
    const auto& theta = rls.parameters();
    if (const resonid_status status = resonid::c::check_array(parameters, count, theta.size())) return status;
    for (std::size_t i = 0; i < count; ++i) parameters[i] = static_cast<double>(theta[i]);
    return RESONID_OK;
  });
}
resonid_status resonid_rls_covariance(const resonid_rls* handle, double* covariance, size_t count) noexcept {
  return Rlss::visit(handle, [&](const auto& rls) -> resonid_status {
    constexpr std::size_t kN = std::remove_cvref_t<decltype(rls)>::kParameters;
    if (const resonid_status status = resonid::c::check_array(covariance, count, kN * kN)) return status;
    const auto matrix = rls.covariance();
    for (std::size_t i = 0; i < count; ++i)
      covariance[i] = static_cast<double>(matrix(static_cast<int>(i / kN), static_cast<int>(i % kN)));
    return RESONID_OK;
  });
}
resonid_status resonid_rls_get_info(const resonid_rls* handle, resonid_rls_info* info,
                                    size_t struct_size) noexcept {
  resonid_rls_info found{};
  const resonid_status status = Rlss::visit(handle, [&](const auto& rls) {
    found.parameters = static_cast<std::uint32_t>(resonid::c::parameters_of(rls));
    found.excited = rls.excited() ? 1 : 0;
    found.samples = rls.samples();
    found.skipped_samples = rls.skipped_samples();
    found.residual = static_cast<double>(rls.residual());
    found.residual_variance = static_cast<double>(rls.residual_variance());
    found.memory_samples = static_cast<double>(rls.memory_samples());
    found.mean_age_samples = static_cast<double>(rls.mean_age_samples());
  });
  return status != RESONID_OK ? status : resonid::c::give(found, info, struct_size);
}
