// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <resonid/report/detail/document.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::reproduction {

struct Options {
  std::size_t seeds = 20;                ///< noisy runs that means and deviations are taken over, >= 2
  std::function<void(double)> progress;  ///< called with the part done, 0 ... 1; may be empty
};

/// A published experiment that can be run again.
struct Entry {
  std::string_view name;   ///< "iv"
  std::string_view title;  ///< "Publication IV: ..."
  report::Document (*run)(const Options&);
};

/// In the order of the source.
[[nodiscard]] const std::vector<Entry>& entries();

/// Publication I: off-line output error of a belt drive under a PRBS, and the controller that follows from
/// it.
[[nodiscard]] report::Document publication_i(const Options& options);

/// Publication II: direct recursive output error of a tooth belt whose cart moves, in closed and open loop.
[[nodiscard]] report::Document publication_ii(const Options& options);

/// Publication III: the same belt indirectly, by closed-loop output error, against direct estimates.
[[nodiscard]] report::Document publication_iii(const Options& options);

/// Publication IV: a multisine tracked by a bank of fixed-gain Kalman filters, and the gap between two belts.
[[nodiscard]] report::Document publication_iv(const Options& options);

/// Publication V: sliding DFTs of a multisine on a tooth belt, and a model fitted to them over the position.
[[nodiscard]] report::Document publication_v(const Options& options);

/// Publication VI: a chirp tracked by one Kalman filter that follows it, the Nyquist plot's distances, and a
/// two-mass fit.
[[nodiscard]] report::Document publication_vi(const Options& options);

}  // namespace resonid::reproduction
