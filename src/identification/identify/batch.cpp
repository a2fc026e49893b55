// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <exception>
#include <mutex>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/identification/batch.hpp>

#include "linalg/parallel.hpp"

namespace resonid::identification {
namespace {

BatchEntry identified(const BatchTask& task, std::size_t i) {
  BatchEntry entry{task.files[i], std::nullopt, {}};
  try {
    auto job = task.load(i);
    if (!job) {
      entry.error = job.error();
      return entry;
    }
    auto result = identify(job->record, job->options);
    if (!result) {
      entry.error = result.error();
      return entry;
    }
    if (task.each) task.each(i, job->record, *result);
    entry.result = std::move(*result);
  } catch (const std::exception& failure) {  // one record's lack of memory must not take the others along
    entry.error = {"", failure.what()};
  }
  return entry;
}

void weigh(Spread& s) {
  const auto n = static_cast<double>(s.values.size());
  double plain = 0.0, weight = 0.0, weighted = 0.0;
  bool known = true;
  for (const auto& v : s.values) {
    plain += v.value / n;
    known = known && v.std.has_value();
    if (!v.std) continue;
    weight += 1.0 / (*v.std * *v.std);
    weighted += v.value / (*v.std * *v.std);
  }
  s.mean = known ? weighted / weight : plain;
  double sum = 0.0;
  for (const auto& v : s.values) sum += std::pow(v.value - plain, 2);
  if (s.values.size() > 1) s.deviation = std::sqrt(sum / (n - 1.0));
  if (!known) return;
  s.std = std::sqrt(1.0 / weight);
  if (s.values.size() < 2) return;
  s.degrees = s.values.size() - 1;
  s.chi_square = 0.0;
  for (const auto& v : s.values) *s.chi_square += std::pow((v.value - s.mean) / *v.std, 2);
  s.probability = chi_square_tail(*s.chi_square, s.degrees);
}

/// Holm 1979: the smallest probability against level/m, the next against level/(m-1) ... until one holds.
void judge(std::vector<Spread>& list, double confidence) {
  std::vector<Spread*> tests;
  for (auto& s : list)
    if (s.probability) tests.push_back(&s);
  std::sort(tests.begin(), tests.end(),
            [](const Spread* a, const Spread* b) { return *a->probability < *b->probability; });
  for (std::size_t i = 0; i < tests.size(); ++i) {
    if (*tests[i]->probability > (1.0 - confidence) / static_cast<double>(tests.size() - i)) break;
    tests[i]->agrees = false;
  }
}

}  // namespace

bool Batch::complete() const {
  return std::all_of(entries.begin(), entries.end(),
                     [](const BatchEntry& e) { return e.result.has_value(); });
}

std::vector<Spread> spread(std::span<const BatchEntry> entries, double confidence) {
  std::vector<Spread> list;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (!entries[i].result) continue;
    for (const auto& figure : figures(*entries[i].result)) {
      // The same word in another unit is another figure.
      auto place = std::find_if(list.begin(), list.end(), [&](const Spread& s) {
        return s.name == figure.name && s.unit == figure.unit;
      });
      if (place == list.end()) {
        list.emplace_back();
        place = list.end() - 1;
        place->name = figure.name;
        place->unit = figure.unit;
      }
      place->values.push_back({i, figure.value, figure.std});
    }
  }
  for (auto& s : list) weigh(s);
  judge(list, confidence);
  return list;
}

Batch identify_batch(const BatchTask& task) {
  Batch batch;
  batch.entries.resize(task.files.size());
  std::mutex telling;
  std::size_t done = 0;
  linalg::for_each_index(task.files.size(), task.jobs, [&](std::size_t i) {
    batch.entries[i] = identified(task, i);
    const std::lock_guard lock(telling);
    ++done;
    if (task.progress) task.progress(done, batch.entries[i]);
  });
  for (const auto& e : batch.entries)
    if (e.result) batch.confidence = e.result->confidence;
  batch.figures = spread(batch.entries, batch.confidence);
  return batch;
}

}  // namespace resonid::identification
