// SPDX-License-Identifier: MIT
#include <resonid/c/detail/models.h>

#include <array>
#include <resonid/online/models/rls.hpp>
#include <utility>

#include "adaptation.hpp"
#include "handle.hpp"

namespace resonid::c {
namespace {

constexpr std::size_t kMost = RESONID_RLS_MAX_PARAMETERS;

/// One to kMost parameters in double, then in single precision.
template <class F, class Numbers>
struct RlsVariants;
template <class F, std::size_t... I>
struct RlsVariants<F, std::index_sequence<I...>> {
  using Type = Variants<F, online::RecursiveLeastSquares<double, I + 1>...,
                        online::RecursiveLeastSquares<float, I + 1>...>;
};

struct Rlss : RlsVariants<Rlss, std::make_index_sequence<kMost>>::Type {
  using Settings = resonid_rls_settings;
  using Results = resonid_rls_results;
  static constexpr std::uint32_t kId = family_of(RESONID_RLS), kTypes = 1;

  static Settings defaults(std::uint32_t) noexcept {
    const online::RecursiveLeastSquaresConfig r;
    Settings s{};
    s.forgetting = static_cast<std::uint32_t>(r.forgetting);
    s.start_variance = r.start_variance;
    s.factor = r.factor;
    s.smallest_factor = r.smallest_factor;
    s.noise_variance = r.noise_variance;
    s.largest_variance = r.largest_variance;
    s.smallest_variance = r.smallest_variance;
    return s;
  }
  static expected<std::uint32_t> variant(const Settings& s) noexcept {
    if (s.precision > RESONID_FLOAT) return refuse("precision", "must be one of its constants", s.precision);
    if (s.parameters < 1 || s.parameters > kMost)
      return refuse("parameters", "must be 1 ... RESONID_RLS_MAX_PARAMETERS", s.parameters);
    return static_cast<std::uint32_t>(s.precision * kMost + s.parameters - 1);
  }
  static expected<void> build(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    std::array<bool, kMost> fixed{};
    const auto given = array(s.fixed, s.parameters);
    for (std::size_t i = 0; i < given.size(); ++i) fixed[i] = given[i] != 0;
    auto config = adaptation(s);
    if (!config) return unexpected<Error>(config.error());
    config->start = array(s.start, s.parameters);
    config->scale = array(s.scale, s.parameters);
    config->fixed = std::span(fixed).first(given.size());
    return build(memory, variant, *config, std::make_index_sequence<kMost>());
  }
  template <class Real, std::size_t N>
  static void results(const online::RecursiveLeastSquares<Real, N>& rls, Results& r) noexcept {
    r.samples = rls.samples();
    r.skipped_samples = rls.skipped_samples();
    r.parameters = static_cast<std::uint32_t>(N);
    r.excited = rls.excited() ? 1 : 0;
    r.residual = static_cast<double>(rls.residual());
    r.residual_variance = static_cast<double>(rls.residual_variance());
    r.memory_samples = static_cast<double>(rls.memory_samples());
    r.mean_age_samples = static_cast<double>(rls.mean_age_samples());
  }
  template <class T>
  static constexpr std::uint32_t kParameters = static_cast<std::uint32_t>(T::kParameters);
  template <class T>
  static void parameters(const T& rls, double* out) noexcept {
    for (const auto parameter : rls.parameters()) *out++ = static_cast<double>(parameter);
  }
  template <class T>
  static void covariance(const T& rls, double* out) noexcept {
    const auto matrix = rls.covariance();
    for (int i = 0; i < matrix.rows(); ++i)
      for (int j = 0; j < matrix.cols(); ++j) *out++ = static_cast<double>(matrix(i, j));
  }

 private:
  using Make = expected<void> (*)(void*, std::uint32_t, const online::RecursiveLeastSquaresConfig&) noexcept;
  template <class T>
  static expected<void> make(void* memory, std::uint32_t variant,
                             const online::RecursiveLeastSquaresConfig& config) noexcept {
    return place(memory, RESONID_RLS, variant, T::create(config));
  }
  template <std::size_t... I>
  static expected<void> build(void* memory, std::uint32_t variant,
                              const online::RecursiveLeastSquaresConfig& config,
                              std::index_sequence<I...>) noexcept {
    static constexpr Make kMake[] = {&make<online::RecursiveLeastSquares<double, I + 1>>...,
                                     &make<online::RecursiveLeastSquares<float, I + 1>>...};
    return kMake[variant](memory, variant, config);
  }
};
static_assert(handle_size<online::RecursiveLeastSquares<double, kMost>>() <= RESONID_RLS_SIZE);

}  // namespace

const Family kRls = FamilyOf<Rlss>::kFamily;

}  // namespace resonid::c

resonid_status resonid_rls_step(resonid_handle* rls, const double* regressor, size_t count, double value,
                                double weight) noexcept {
  return resonid::c::Rlss::visit(rls, [&](auto& estimator) -> resonid_status {
    using Estimator = std::remove_reference_t<decltype(estimator)>;
    using Real = typename Estimator::Scalar;
    if (const resonid_status status = resonid::c::check_array(regressor, count, Estimator::kParameters))
      return status;
    typename Estimator::Vector f;
    for (std::size_t i = 0; i < f.size(); ++i) f[i] = static_cast<Real>(regressor[i]);
    estimator.step(f, static_cast<Real>(value), static_cast<Real>(weight));
    return RESONID_OK;
  });
}
