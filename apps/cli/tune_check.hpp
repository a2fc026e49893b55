// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <functional>
#include <resonid/data/transfer_function.hpp>
#include <resonid/identification/result.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "record_options.hpp"

namespace resonid::cli {

/// `tune --check RECORD`: the recording under the controller, and how it is identified.
struct TuneCheck {
  RecordOptions record;
  MethodOptions method;
  /// What the call tells, before a result adds to it.
  struct Told {
    std::string name;
    std::vector<std::string> values;
    bool by_profile = false;
  };
  std::vector<Told> told;

  [[nodiscard]] bool is_wanted() const { return !record.record.empty(); }
};

/// --check, and of the options of identify those that describe recording and drive.
void add_check_options(CLI::App& verb, TuneCheck& check);

/// Takes over the controller that ran from the result, and keeps what the call itself tells for
/// identified_for_check().
void inherit_for_tune(CLI::App& verb, TuneCheck& check, const identification::Result& result,
                      const std::string& file);

/// Whether a recording that is checked is identified in one way for both.
[[nodiscard]] bool are_checked_alike(const identification::Result& a, const identification::Result& b);

/// The recording under the new controller, identified as `designed_for` was: by what that result stores of
/// signals, drive and method, unless the call tells it. Its excitation is what it tells; what the result
/// stores of it is taken where it tells none. The loop's own (delay, approach) come from elsewhere, and a
/// band or a stretch is of one recording.
[[nodiscard]] identification::Result identified_for_check(const TuneCheck& check,
                                                          const identification::Result& designed_for,
                                                          const std::string& file,
                                                          const data::TransferFunction& controller,
                                                          std::function<void(std::string_view)> progress);

}  // namespace resonid::cli
