// SPDX-License-Identifier: MIT
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <resonid/base/error_text.hpp>
#include <resonid/io/csv.hpp>
#include <resonid/io/detail/atomic_file.hpp>
#include <resonid/io/record_reader.hpp>

namespace resonid::io {
namespace {

data::Record sample_record(std::size_t samples) {
  data::Record record;
  record.sample_rate_hz = 2500.0;
  for (auto* channel : {&record.excitation, &record.input, &record.output}) channel->samples.resize(samples);
  for (std::size_t i = 0; i < samples; ++i) {
    const auto k = static_cast<double>(i);
    record.excitation.samples[i] = std::sin(0.1 * k);
    record.input.samples[i] = std::sin(0.11 * k);
    record.output.samples[i] = 100.0 * std::sin(0.12 * k);
  }
  record.excitation.unit = record.input.unit = "Nm";
  record.output.unit = "rad/s";
  return record;
}

/// A record file of the wanted length, removed at the end.
class RecordFile {
 public:
  explicit RecordFile(std::size_t samples)
      : path_(std::filesystem::temp_directory_path() /
              ("resonid-bench-" + std::to_string(::getpid()) + ".csv")) {
    written_ = write_file_atomically(path_, record_csv(sample_record(samples))).has_value();
  }
  RecordFile(const RecordFile&) = delete;
  RecordFile& operator=(const RecordFile&) = delete;
  ~RecordFile() {
    std::error_code code;
    std::filesystem::remove(path_, code);
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] bool written() const { return written_; }

 private:
  std::filesystem::path path_;
  bool written_ = false;
};

void read_record_from_csv(benchmark::State& state) {
  const RecordFile file(static_cast<std::size_t>(state.range(0)));
  if (!file.written()) state.SkipWithError("cannot write the record");
  for (auto _ : state) {
    auto record = read_record(file.path(), {});
    if (!record) state.SkipWithError(message_of(record.error()).c_str());
    benchmark::DoNotOptimize(record);
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(read_record_from_csv)->Arg(15'000)->Arg(500'000)->Unit(benchmark::kMillisecond)->UseRealTime();

void write_record_as_csv(benchmark::State& state) {
  const auto record = sample_record(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(record_csv(record));
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(write_record_as_csv)->Arg(15'000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace resonid::io
