// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "monitor/service/configuration.hpp"

namespace resonid::monitor {

/// What was seen of one axis on a source.
struct StreamFacts {
  std::string source;                        ///< Its name in the configuration.
  std::string axis;                          ///< As the source names it; empty: it names none.
  std::vector<std::string> columns;          ///< Names.
  double sample_rate_hz = 0.0;               ///< Told, or by the sender's times; 0: not known.
  std::vector<std::vector<double>> samples;  ///< [column][sample] The first ones; not a number: missing.
  bool timed = false;                        ///< They come with a time, which is no column.
  double arrival_rate_hz = 0.0;              ///< Samples per second of their arrival; 0: not known.
};

/// An axis as it may be configured.
struct Proposal {
  std::string name;
  AxisConfig axis;                 ///< What could not be told is as by default.
  std::vector<std::string> notes;  ///< What was seen and assumed, and what is left to people; a line each.

  /// Nothing that an axis needs is left to people.
  [[nodiscard]] bool complete() const {
    return axis.sample_rate_hz > 0.0 && !axis.input.empty() && !axis.output.empty();
  }
};

/// Which column is which signal, as `resonid inspect` tells from names and units, the rate (of a column of
/// times where the stream tells none, else of arrival), and the output's sign. A hundred samples or more are
/// needed for the sign. Names are made different.
[[nodiscard]] std::vector<Proposal> propose(std::span<const StreamFacts> streams);

/// A configuration of these sources and axes as TOML, notes as comments; so are axes that are not complete.
/// What is as by default is left out.
[[nodiscard]] std::string proposal_text(const std::map<std::string, SourceConfig>& sources,
                                        std::span<const Proposal> proposals);

}  // namespace resonid::monitor
