// SPDX-License-Identifier: MIT
#include "tune_exports.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>
#include <resonid/io/detail/suggestion.hpp>

#include "errors.hpp"

namespace resonid::cli {

std::vector<TuneExport> exports_of(const std::vector<std::string>& texts) {
  std::vector<std::string> known;
  for (const auto& format : enum_names(identification::ExportFormat{})) known.emplace_back(format.name);
  std::vector<TuneExport> list;
  for (const auto& text : texts) {
    const auto colon = text.find(':');
    const std::string format = text.substr(0, colon);
    const auto found = std::find(known.begin(), known.end(), format);
    if (colon == std::string::npos || colon + 1 == text.size() || found == known.end())
      throw UsageError(fmt::format("--export: found '{}', required FORMAT:FILE with one of {}{}", text,
                                   fmt::join(known, ", "),
                                   found == known.end() ? io::suggestion(format, known) : std::string()));
    list.push_back(
        {enum_names(identification::ExportFormat{})[static_cast<std::size_t>(found - known.begin())].value,
         text.substr(colon + 1)});
  }
  return list;
}

std::string name_of_structure(const std::string& structure, std::size_t order) {
  if (structure == "pi+biquads") {  // an order of one and of two for each filter
    const std::size_t count = order / 2;
    if (count == 0 || order % 2 == 0) return {};
    return fmt::format("PI + {} biquad{}", count, count == 1 ? "" : "s");
  }
  if (structure == "pid") return "PID";
  if (structure == "rst") return "RST";
  return structure == "state-feedback" ? "State feedback" : "";
}

bool put_parts(const io::ControllerFile& file, identification::TunedController& judged) {
  if (!file.parts || file.position_gain) return true;
  const auto& parts = *file.parts;
  design::FilteredPi gains{parts.kp, parts.ki, {}};
  for (const auto& b : parts.biquads)
    gains.biquads.push_back({b.frequency_hz, b.numerator_damping, b.denominator_damping});
  design::FilteredPi way = gains;
  way.kp *= parts.set_point_weight;
  const double step = file.sample_time_s;
  const auto law = gains.transfer_function(step), by_reference = way.transfer_function(step);
  const data::TransferFunction reference{
      file.reference_numerator.empty() ? file.numerator : file.reference_numerator, file.denominator, step};
  constexpr double kSame = 1e-3;  // of files whose numbers were rounded
  const auto is_same = [](std::complex<double> a, std::complex<double> b) {
    return std::abs(a - b) <= kSame * std::abs(b);
  };
  for (const double part : {0.003, 0.03, 0.1, 0.3}) {
    const double hz = part / step;
    std::complex<double> derivative = 0.0;
    if (parts.derivative_gain) {
      const auto z = std::polar(1.0, kTwoPi * part);
      const double pole = std::exp(-step / *parts.derivative_time_s);
      derivative = *parts.derivative_gain * (1.0 - pole) / step * (z - 1.0) / (z - pole);
    }
    if (!is_same(law.response(hz) + derivative, file.response(hz)) ||
        !is_same(by_reference.response(hz), reference.response(hz)))
      return false;
  }
  judged.gains = std::move(gains);
  judged.derivative_gain = parts.derivative_gain;
  judged.derivative_time_s = parts.derivative_time_s;
  judged.set_point_weight = parts.set_point_weight;
  return true;
}

}  // namespace resonid::cli
