// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <reproduce/reproduction.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/report/detail/document.hpp>
#include <string>
#include <vector>

#include "reproduce/spread.hpp"
#include "reproduce/vi_tracking.hpp"

namespace resonid::reproduction::vi {

/// Error lines of one estimator: one noise-free run, and means over the seeds of each run's figures.
void add_noise_free_rows(report::ComparisonTable& table, const std::string& name, const ResponseErrors& e);
void add_noisy_rows(report::ComparisonTable& table, const std::string& name,
                    const std::vector<ResponseErrors>& runs);

[[nodiscard]] report::Curve magnitude_curve(std::string name, report::Curve::Mark mark,
                                            const data::FrequencyResponse& g);
/// Phase in degrees, on the branch nearest to the truth's phase.
[[nodiscard]] report::Curve phase_curve(std::string name, report::Curve::Mark mark,
                                        const data::FrequencyResponse& g,
                                        const data::FrequencyResponse& truth);
/// Points of a Nyquist plane within +-1.25, with their frequencies; further out there are gaps.
[[nodiscard]] report::Curve plane_curve(std::string name, report::Curve::Mark mark,
                                        const data::FrequencyResponse& loop);

/// Response and its name in a Bode chart; the first one is the reference of the phases.
struct Named {
  std::string name;
  data::FrequencyResponse response;
  report::Curve::Mark mark = report::Curve::Mark::line;
};
/// A magnitude and a phase chart.
void add_bode(report::Section& section, const std::string& title, const std::vector<Named>& responses,
              const std::string& caption);

/// One part of the page, and what of it belongs into the page's summary.
struct Part {
  report::Section section;
  std::vector<std::string> summary;
  std::vector<report::ComparisonTable> head;  ///< Tables that stand before all sections.
};
[[nodiscard]] Part figure_3(const Options& options);   ///< Responses of systems A and B, residuals.
[[nodiscard]] Part figure_4(const Options& options);   ///< Filter, amplitude and sweep time varied.
[[nodiscard]] Part figure_5(const Options& options);   ///< Nyquist distances of system A.
[[nodiscard]] Part figure_7(const Options& options);   ///< Off line: averaged spectra, Table 2.
[[nodiscard]] Part tensioner(const Options& options);  ///< Figure 7 and Table 2 with a third mass.
[[nodiscard]] Part figure_9(const Options& options);   ///< Distances over the filter's gain.
[[nodiscard]] Part figure_10(const Options& options);  ///< Swept from 100 Hz.
[[nodiscard]] Part figure_11(const Options& options);  ///< Indirect against direct.

[[nodiscard]] std::vector<report::Discrepancy> discrepancies();

}  // namespace resonid::reproduction::vi
