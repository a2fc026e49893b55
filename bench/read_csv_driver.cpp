// SPDX-License-Identifier: MIT
// Reads a CSV file several times and prints the seconds of each reading: bench_read_csv FILE [TIMES].
// The samples' sum goes to standard error, so that another reader's result can be compared.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <resonid/base/error_text.hpp>
#include <resonid/io/detail/table.hpp>

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: bench_read_csv FILE [TIMES]\n", stderr);
    return 2;
  }
  const int times = argc > 2 ? std::atoi(argv[2]) : 1;
  for (int i = 0; i < times; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    const auto table = resonid::io::read_csv(argv[1]);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
    if (!table) {
      std::fprintf(stderr, "%s\n", message_of(table.error()).c_str());
      return 2;
    }
    double sum = 0.0;
    for (const auto& column : table->columns)
      for (const double value : column) sum += value;
    std::printf("%.6f\n", taken.count());
    std::fprintf(stderr, "%zu columns, %zu rows, sum %.17g\n", table->columns.size(),
                 table->columns[0].size(), sum);
  }
  return 0;
}
