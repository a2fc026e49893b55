// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>
#include <monitor/store/reader.hpp>
#include <monitor/store/row_codec.hpp>
#include <monitor/store/sqlite.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace resonid::monitor {

/// An axis as the tables know it.
struct AxisKey {
  std::int64_t id = 0;
  double memory_s = 0.0;
};

class Reader::Impl {
 public:
  explicit Impl(const std::string& path)
      : connection(path, SQLITE_OPEN_READWRITE, 2000) {  // the log's index is shared in writable memory
    // The file is mapped; only pages that are still in the log go through the cache.
    connection.execute("PRAGMA query_only=ON; PRAGMA mmap_size=1073741824; PRAGMA cache_size=-256");
  }

  /// What `work` returns, in one read-only transaction.
  template <class Work>
  [[nodiscard]] auto read(Work&& work) {
    return detail::guarded([&] {
      const detail::Transaction transaction(connection, detail::Transaction::Kind::read);
      return work();
    });
  }

  [[nodiscard]] std::optional<AxisKey> axis(std::string_view name);

  /// Rows of a stretch in the order of time, each once: visit(time_ns, sample, RowBytes) until it says false.
  template <class Visit>
  void visit_rows(std::int64_t axis_id, std::int64_t from_ns, std::int64_t to_ns, Visit&& visit);

  detail::Connection connection;
};

[[nodiscard]] constexpr std::int64_t sql_limit(std::size_t limit) noexcept {
  constexpr std::size_t kMost = 10'000'000;
  return static_cast<std::int64_t>(limit < kMost ? limit : kMost);
}

/// The newest rows are in `fresh`, some of them in both tables; two ordered streams are merged.
template <class Visit>
void Reader::Impl::visit_rows(std::int64_t axis_id, std::int64_t from_ns, std::int64_t to_ns, Visit&& visit) {
  detail::Query settled(
      connection,
      "SELECT time_ns, sample, data FROM rows WHERE axis = ? AND time_ns >= ? AND time_ns < ? "
      "ORDER BY time_ns, sample",
      axis_id, from_ns, to_ns);
  detail::Query fresh(
      connection,
      "SELECT time_ns, sample, data FROM fresh WHERE axis = ? AND time_ns >= ? AND time_ns < ? "
      "ORDER BY time_ns, sample",
      axis_id, from_ns, to_ns);
  bool in_settled = settled.next(), in_fresh = fresh.next();
  while (in_settled || in_fresh) {
    const auto key = [](const detail::Query& query, bool there) {
      constexpr auto kLast = std::numeric_limits<std::int64_t>::max();
      return there ? std::pair(query.integer(0), query.integer(1)) : std::pair(kLast, kLast);
    };
    const auto at_settled = key(settled, in_settled), at_fresh = key(fresh, in_fresh);
    const bool takes_settled = at_settled <= at_fresh;
    const auto& [time_ns, sample] = takes_settled ? at_settled : at_fresh;
    if (const auto row = RowBytes::of((takes_settled ? settled : fresh).bytes(2)))
      if (!visit(time_ns, static_cast<std::uint64_t>(sample), *row)) return;
    if (at_settled <= at_fresh) in_settled = settled.next();
    if (at_fresh <= at_settled) in_fresh = fresh.next();
  }
}

}  // namespace resonid::monitor
