// SPDX-License-Identifier: MIT
#include <resonid/c/detail/supervision.h>

#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/detail/controller_response.hpp>
#include <resonid/online/supervision/change_detection.hpp>
#include <resonid/online/supervision/loop_margins.hpp>

#include "change_config.hpp"
#include "handle.hpp"

namespace resonid::c {
namespace {

constexpr std::size_t kMostBlocks = 256;
using Detector = online::ChangeDetector<double, kMostBlocks>;

struct Changes : Variants<Changes, Detector> {
  using Settings = resonid_change_settings;
  using Results = resonid_change_results;
  static constexpr std::uint32_t kId = family_of(RESONID_CUSUM), kTypes = 2;

  static Settings defaults(std::uint32_t kind) noexcept { return ChangeDefaults::defaults(kind); }
  static expected<std::uint32_t> variant(const Settings&) noexcept { return 0U; }
  static expected<void> build(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    return place(memory, s.head.kind, variant, Detector::create(change_config(s)));
  }
  static void results(const Detector& detector, Results& r) noexcept {
    r.samples = detector.samples();
    r.skipped_samples = detector.skipped_samples();
    r.ready = detector.ready() ? 1 : 0;
    r.alarm = detector.alarm() ? 1 : 0;
    r.reliable = detector.reliable() ? 1 : 0;
    r.level = detector.level();
    r.baseline = detector.baseline();
    r.block_std = detector.block_std();
    if (!detector.alarm()) return;
    const auto change = detector.change();
    r.time_s = change.time_s;
    r.detected_s = change.detected_s;
    r.size = change.size;
    r.size_std = change.size_std;
  }
};

}  // namespace

const Family kChange = FamilyOf<Changes>::kFamily;

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
      return fail(error, RESONID_ERROR_SETTINGS, "frequency_hz", "must be > 0 and ascend", frequency_hz[i]);
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
    return fail(error, RESONID_ERROR_SETTINGS, "sample_rate_hz", "must be > 0", sample_rate_hz);
  if (numerator_count == 0 || denominator_count == 0)
    return fail(error, RESONID_ERROR_SETTINGS, "numerator_count", "must be 1 ... 16, as the denominator's");
  auto controller = resonid::online::ControllerResponse<1>::create({}, {numerator, numerator_count},
                                                                   {denominator, denominator_count});
  if (!controller) {
    constexpr std::string_view kPrefix = "controller_";
    const resonid::Error& fault = controller.error();
    return fail(error, RESONID_ERROR_SETTINGS, fault.field.view().substr(kPrefix.size()), fault.requirement,
                fault.value);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::complex<double> delay = std::polar(1.0, -resonid::kTwoPi * frequency_hz[i] * delay_s);
    const std::complex<double> g(response[i].re, response[i].im);
    const auto l = controller->at(0, frequency_hz[i] / sample_rate_hz) * g * delay;
    loop[i] = {l.real(), l.imag()};
  }
  return RESONID_OK;
}

resonid_status resonid_change_step(resonid_handle* change, double value, double standard_deviation) noexcept {
  return Changes::visit(change, [&](auto& detector) { detector.step(value, standard_deviation); });
}
resonid_status resonid_change_relearn(resonid_handle* change) noexcept {
  return Changes::visit(change, [](auto& detector) { detector.relearn(); });
}
