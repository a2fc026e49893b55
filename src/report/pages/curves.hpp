// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/frequency_response.hpp>
#include <resonid/report/detail/document.hpp>
#include <resonid/response/detail/power_spectrum.hpp>
#include <span>
#include <string>
#include <vector>

// Curves that the pages of several verbs draw.
namespace resonid::report {

inline constexpr std::size_t kCurveBins = 1500;
/// Lowest and highest value per bin, drawn one after the other: every peak shows, whatever the length. Up to
/// two samples per bin all of them.
[[nodiscard]] Curve thinned(const std::string& name, std::span<const double> x, double start_s,
                            double rate_hz, std::size_t bins = kCurveBins);

[[nodiscard]] Curve level_db(const std::string& name, const data::FrequencyResponse& g,
                             Curve::Mark mark = Curve::Mark::line);
/// Phase in degrees, continued without jumps.
[[nodiscard]] Curve phase_deg(const std::string& name, const data::FrequencyResponse& g,
                              Curve::Mark mark = Curve::Mark::line);

/// Whether a line says anything: its standard deviation is less than half its magnitude, and its coherence,
/// where that is known, at least 0.3. Where nothing excites the machine it is not.
[[nodiscard]] bool determined(const data::FrequencyResponse& g, std::size_t line);

/// Magnitude and phase of a response over logarithmic frequency, `magnitude` and `phase` being charts of one
/// section: lines that say nothing are faint, and the axes do not reach for them.
struct BodeCharts {
  Chart magnitude, phase;

  BodeCharts();
  void add_measured(const std::string& name, const data::FrequencyResponse& g, Curve::Mark mark);
  void add_model(const std::string& name, const data::FrequencyResponse& g);
};

/// A curve of the loop in the complex plane; a gap beyond |L| = 4, where nothing is judged.
[[nodiscard]] Curve nyquist_curve(const std::string& name, const data::FrequencyResponse& loop,
                                  Curve::Mark mark = Curve::Mark::line);
/// The plane that loops are drawn in: unit circle, the point -1, both axes -2 ... 2.
[[nodiscard]] Chart nyquist_plane(const std::string& title);

/// Power per line in dB; lines without power are left out.
[[nodiscard]] Curve power_curve(const std::string& name, const response::PowerSpectrum& spectrum,
                                Curve::Mark mark = Curve::Mark::line);

/// The end of a path, which tells files apart.
[[nodiscard]] std::string base_name(const std::string& path);

/// A card of an estimate: its value, and below it the half-width of its interval.
[[nodiscard]] Card estimate_card(const std::string& name, double value, double half_width,
                                 const std::string& unit, double confidence,
                                 std::vector<std::string> under = {});

}  // namespace resonid::report
