// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/identification/detail/figures.hpp>
#include <resonid/identification/identify.hpp>
#include <span>
#include <string>
#include <vector>

namespace resonid::identification {

/// One record of many: what came out of it, or why nothing did.
struct BatchEntry {
  std::string file;
  std::optional<Result> result;
  Error error;  ///< Without a result; its option is empty where no option is at fault.
};

/// One figure over all records that have it, as repetitions of one experiment would scatter.
struct Spread {
  std::string name, unit;  ///< As in figures().
  struct Value {
    std::size_t record = 0;  ///< Index of the entry.
    double value = 0.0;
    std::optional<double> std;
  };
  std::vector<Value> values;
  double mean = 0.0;          ///< Weighted by inverse variances where all are known, plain otherwise.
  std::optional<double> std;  ///< Standard deviation of the weighted mean.
  double deviation = 0.0;     ///< Standard deviation over the records; 0 for one.
  std::size_t degrees = 0;    ///< Degrees of freedom: records less one; 0 where the error bars are not known.
  std::optional<double> chi_square;   ///< sum ((x - mean)/std)^2
  std::optional<double> probability;  ///< Probability of a scatter at least so large by the error bars alone.
  bool agrees = true;                 ///< Judged over all figures together (Holm 1979).
};

/// Many records identified one by one.
struct Batch {
  std::vector<BatchEntry> entries;  ///< In the order given.
  std::vector<Spread> figures;
  double confidence = 0.95;
  [[nodiscard]] bool complete() const;  ///< Every record has a result.
};

/// A record with the options that belong to it (a controller runs at the record's sample time).
struct BatchJob {
  data::Record record;
  Options options;
};

struct BatchTask {
  std::vector<std::string> files;
  std::function<expected<BatchJob, Error>(std::size_t)> load;
  /// Called after a record's identification, on the thread that did it; may be empty.
  std::function<void(std::size_t, const data::Record&, const Result&)> each;
  /// Called when a record is done, one call at a time; may be empty.
  std::function<void(std::size_t done, const BatchEntry&)> progress;
  std::size_t jobs = 0;  ///< Threads; 0: one per core. Results do not depend on it.
};

/// Every record by identify(), in parallel. A record that cannot be read or identified does not stop the
/// others. Figures of the same name are set side by side, with their scatter compared with their error bars:
///
///   mean = sum(x/s^2)/sum(1/s^2),   chi2 = sum ((x - mean)/s)^2 ~ chi2(n - 1)
[[nodiscard]] Batch identify_batch(const BatchTask& task);

/// The figures of results side by side; `results` may hold nothing at places.
[[nodiscard]] std::vector<Spread> spread(std::span<const BatchEntry> entries, double confidence);

}  // namespace resonid::identification
