// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace resonid::report {

/// One self-contained HTML page that shows an identification: no network, no other files, readable on a
/// phone, in the dark and on paper. A pure function of its data.
///
/// `data` is the object of `identify --json` (with put_provenance() that too), and for the pictures a key
/// "page" beside it, all of it optional:
///
///     title            shown on top
///     confidence       of every band and range drawn, 0.95 unless told
///     units            {input, output, excitation, response}
///     model_curve      {frequency_hz, real, imag}: the fitted model on a dense grid, known delay removed
///     loop_curve       {frequency_hz, real, imag, std, source: "model"|"response"}: L = C G, delay included
///     loop_measured    {frequency_hz, real, imag, std}: L at the measured lines
///     loop_marks       [{kind: "crossover"|"modulus"|"gain", frequency_hz, real, imag}]
///     signals          {time_s, channels: [{role, name, unit, min, max}]}: envelopes per bin
///     residual         {time_s, min, max, unit}: output less the simulated model
///     overlay          chart: the output, measured and simulated
///     sensitivity      chart: |S| and |T|; peaks {ms, ms_hz, mt, mt_hz}
///     spectra          charts: power of input and output, lines of the response marked
///     inertia_ratio    {value, std}: load over motor
///     summary          plain sentences
///
/// Charts are as document_json() has them (document.hpp).
///
/// Curves of "page" are kept to 7 significant digits. A page that would grow beyond kPageBytes is thinned:
/// envelopes get wider bins, curves and measured lines fewer points (evenly over log frequency), and the page
/// says how many it draws. Text of any origin is escaped; bytes that are not UTF-8 are replaced.
[[nodiscard]] std::string page(const nlohmann::json& data);

/// Upper limit of page() for results whose size lies in curves, lines and signals.
inline constexpr std::size_t kPageBytes = 2'800'000;

/// Text as it may stand between tags or in a quoted attribute.
[[nodiscard]] std::string escape_html(std::string_view text);

/// JSON as it may stand inside a script element: no `<`, `>` or `&`, ASCII only, bytes that are not UTF-8
/// replaced.
[[nodiscard]] std::string script_json(const nlohmann::json& data);

}  // namespace resonid::report
