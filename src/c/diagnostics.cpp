// SPDX-License-Identifier: MIT
#include <resonid/c/diagnostics.h>

#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/detail/controller_response.hpp>
#include <resonid/online/supervision/change_detection.hpp>
#include <resonid/online/supervision/running_margins.hpp>

#include "handle.hpp"

namespace resonid::c {
namespace {

constexpr std::size_t kMostBlocks = 256;
using Detector = online::ChangeDetector<double, kMostBlocks>;

resonid_change_config change_defaults() noexcept {
  const online::ChangeDetectorConfig d;
  resonid_change_config c{};
  c.statistic = static_cast<std::uint32_t>(d.statistic);
  c.reference = d.reference;
  c.window_blocks = static_cast<std::uint32_t>(d.window_blocks);
  return c;
}

struct Changes : Variants<RESONID_FAMILY_CHANGE, Detector> {
  using Config = resonid_change_config;
  using Handle = resonid_change;

  static Config defaults_for(const Config*) noexcept { return change_defaults(); }
  static expected<std::uint32_t, Error> variant(const Config&) noexcept { return 0U; }
  static std::size_t size(std::uint32_t variant) noexcept { return kSize[variant]; }
  static expected<void, Error> build(void* memory, std::uint32_t variant, const Config& c) noexcept {
    const auto statistic = enumerator("statistic", c.statistic, online::ChangeStatistic::likelihood_ratio);
    if (!statistic) return unexpected<Error>(statistic.error());
    const auto made = Detector::create({c.sample_rate_hz, c.block_s, c.baseline_s, c.false_alarm_interval_s,
                                        *statistic, c.reference, c.window_blocks});
    if (!made) return unexpected<Error>(made.error());
    place(memory, kFamily, variant, *made);
    return {};
  }
};

}  // namespace
}  // namespace resonid::c

using resonid::c::Changes;
using resonid::c::fail;

resonid_status resonid_margins(const double* frequency_hz, const resonid_complex* loop, size_t count,
                               resonid_loop_margins* margins, size_t struct_size,
                               resonid_error* error) noexcept {
  if (frequency_hz == nullptr) return resonid::c::fail_null(error, "frequency_hz");
  if (loop == nullptr) return resonid::c::fail_null(error, "loop");
  for (std::size_t i = 0; i < count; ++i)
    if (!(frequency_hz[i] > (i > 0 ? frequency_hz[i - 1] : 0.0)))
      return fail(error, RESONID_ERROR_CONFIG, {"frequency_hz", "must be > 0 and ascend", frequency_hz[i]});
  resonid::online::MarginScan<double> scan;
  for (std::size_t i = 0; i < count; ++i) scan.step(frequency_hz[i], {loop[i].re, loop[i].im});
  const auto& m = scan.margins();
  resonid_loop_margins found{};
  found.crossover_hz = m.crossover_hz;
  found.phase_margin_deg = m.phase_margin_deg;
  found.worst_phase_margin_deg = m.worst_phase_margin_deg;
  found.modulus_margin = m.modulus_margin;
  found.modulus_margin_hz = m.modulus_margin_hz;
  found.gain_margin_db = m.gain_margin_db;
  found.gain_margin_hz = m.gain_margin_hz;
  return resonid::c::give(found, margins, struct_size);
}

resonid_status resonid_loop_response(const double* numerator, size_t numerator_count,
                                     const double* denominator, size_t denominator_count,
                                     double sample_rate_hz, double delay_s, const double* frequency_hz,
                                     const resonid_complex* response, resonid_complex* loop, size_t count,
                                     resonid_error* error) noexcept {
  if (numerator == nullptr) return resonid::c::fail_null(error, "numerator");
  if (denominator == nullptr) return resonid::c::fail_null(error, "denominator");
  if (frequency_hz == nullptr) return resonid::c::fail_null(error, "frequency_hz");
  if (response == nullptr) return resonid::c::fail_null(error, "response");
  if (loop == nullptr) return resonid::c::fail_null(error, "loop");
  if (!(sample_rate_hz > 0.0) || !std::isfinite(sample_rate_hz))
    return fail(error, RESONID_ERROR_CONFIG, {"sample_rate_hz", "must be > 0", sample_rate_hz});
  if (numerator_count == 0 || denominator_count == 0)
    return fail(error, RESONID_ERROR_CONFIG, {"numerator_count", "must be 1 ... 16, as the denominator's"});
  auto controller = resonid::online::ControllerResponse<1>::create({}, {numerator, numerator_count},
                                                                   {denominator, denominator_count});
  if (!controller) {
    constexpr std::string_view kPrefix = "controller_";
    controller.error().field = controller.error().field.view().substr(kPrefix.size());
    return fail(error, RESONID_ERROR_CONFIG, controller.error());
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::complex<double> delay = std::polar(1.0, -resonid::kTwoPi * frequency_hz[i] * delay_s);
    const std::complex<double> g(response[i].re, response[i].im);
    const auto l = controller->at(0, frequency_hz[i] / sample_rate_hz) * g * delay;
    loop[i] = {l.real(), l.imag()};
  }
  return RESONID_OK;
}

resonid_status resonid_change_defaults(resonid_change_config* config, size_t struct_size) noexcept {
  return resonid::c::give_defaults(resonid::c::change_defaults(), config, struct_size);
}
size_t resonid_change_size(const resonid_change_config* config) noexcept {
  return resonid::c::size_of<Changes>(config);
}
resonid_status resonid_change_init(void* memory, size_t size, const resonid_change_config* config,
                                   resonid_change** handle, resonid_error* error) noexcept {
  return resonid::c::init<Changes>(memory, size, config, handle, error);
}
resonid_status resonid_change_create(const resonid_change_config* config, resonid_change** handle,
                                     resonid_error* error) noexcept {
  return resonid::c::create<Changes>(config, handle, error);
}
resonid_status resonid_change_step(resonid_change* handle, double value, double standard_deviation) noexcept {
  return Changes::visit(handle, [&](auto& detector) { detector.step(value, standard_deviation); });
}
resonid_status resonid_change_reset(resonid_change* handle) noexcept {
  return Changes::visit(handle, [](auto& detector) { detector.reset(); });
}
resonid_status resonid_change_relearn(resonid_change* handle) noexcept {
  return Changes::visit(handle, [](auto& detector) { detector.relearn(); });
}
resonid_status resonid_change_get_info(const resonid_change* handle, resonid_change_info* info,
                                       size_t struct_size) noexcept {
  resonid_change_info found{};
  const resonid_status status = Changes::visit(handle, [&](const auto& detector) {
    found.ready = detector.ready() ? 1 : 0;
    found.alarm = detector.alarm() ? 1 : 0;
    found.reliable = detector.reliable() ? 1 : 0;
    found.samples = detector.samples();
    found.skipped_samples = detector.skipped_samples();
    found.level = detector.level();
    found.baseline = detector.baseline();
    found.block_std = detector.block_std();
    if (!detector.alarm()) return;
    const auto change = detector.change();
    found.time_s = change.time_s;
    found.detected_s = change.detected_s;
    found.size = change.size;
    found.size_std = change.size_std;
  });
  return status != RESONID_OK ? status : resonid::c::give(found, info, struct_size);
}
