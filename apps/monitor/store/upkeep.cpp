// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <monitor/store/row_codec.hpp>
#include <monitor/store/store_impl.hpp>
#include <monitor/store/summary.hpp>
#include <vector>

namespace resonid::monitor {
namespace {

using detail::kDayNs;
using detail::kFiveMinutesNs;
using detail::kHourNs;
using detail::Query;
using detail::run;
using detail::start_of;
using detail::Transaction;

constexpr std::int64_t kSecondNs = 1'000'000'000;
constexpr std::int64_t kMoveEveryNs = 60 * kSecondNs;
constexpr std::int64_t kMoveRowsPerAxis = 60;
constexpr std::int64_t kMoveRowsPerStep = 2000;
constexpr std::int64_t kSettleAfterNs = 120 * kSecondNs;  // an hour's last rows are in their place by then
constexpr std::int64_t kRetainEveryNs = 10 * kSecondNs;
constexpr std::int64_t kFreePages = 4096;  // not worth returning
constexpr std::int64_t kReturnedPages = 512;

/// The instant `age_s` before now; nothing is older than it where the age is 0.
std::int64_t before(std::int64_t now_ns, double age_s) {
  constexpr double kLongestS = 9e9;  // int64 in ns
  if (!(age_s > 0.0) || age_s > kLongestS) return std::numeric_limits<std::int64_t>::min();
  return now_ns - static_cast<std::int64_t>(age_s * 1e9);
}

double memory_of(detail::Connection& connection, std::int64_t axis) {
  Query query(connection, "SELECT memory_s FROM axes WHERE id = ?", axis);
  return query.next() ? query.real(0) : 0.0;
}

/// All figures over a stretch of rows.
class RowGatherer {
 public:
  void add(std::int64_t time_ns, const RowBytes& row) {
    for (std::size_t i = 0; i < figures_.size(); ++i)
      figures_[i].add(time_ns, row.figure(static_cast<monitoring::Watched>(i)), row.trusted());
    any_ = true;
  }
  [[nodiscard]] bool any() const { return any_; }
  /// And begins anew.
  [[nodiscard]] Summary take(double memory_s) {
    Summary summary;
    for (std::size_t i = 0; i < figures_.size(); ++i) {
      summary[i] = figures_[i].summary(memory_s);
      figures_[i].clear();
    }
    any_ = false;
    return summary;
  }

 private:
  std::array<FigureGatherer, monitoring::kWatched> figures_;
  bool any_ = false;
};

/// An hour, and the five minutes of it that have rows.
struct HourSummaries {
  Summary hour;
  std::vector<std::pair<std::int64_t, Summary>> five_minutes;  // with their starts
};

HourSummaries summaries_of_hour(detail::Connection& connection, std::int64_t axis, std::int64_t start_ns,
                                double memory_s) {
  HourSummaries all;
  RowGatherer hour, part;
  std::int64_t part_ns = start_ns;
  const auto end_part = [&] {
    if (part.any()) all.five_minutes.emplace_back(part_ns, part.take(memory_s));
  };
  Query query(connection,
              "SELECT time_ns, data FROM rows WHERE axis = ? AND time_ns >= ? AND time_ns < ? "
              "ORDER BY time_ns, sample",
              axis, start_ns, start_ns + kHourNs);
  while (query.next()) {
    const auto row = RowBytes::of(query.bytes(1));
    if (!row) continue;
    const std::int64_t time_ns = query.integer(0);
    if (time_ns >= part_ns + kFiveMinutesNs) {
      end_part();
      part_ns = start_of(time_ns, kFiveMinutesNs);
    }
    part.add(time_ns, *row);
    hour.add(time_ns, *row);
  }
  end_part();
  all.hour = hour.take(memory_s);
  return all;
}

Summary summary_of_day(detail::Connection& connection, std::int64_t axis, std::int64_t start_ns,
                       double memory_s) {
  std::array<std::vector<FigureSummary>, monitoring::kWatched> hours;
  Query query(connection,
              "SELECT data FROM hours WHERE axis = ? AND start_ns >= ? AND start_ns < ? ORDER BY start_ns",
              axis, start_ns, start_ns + kDayNs);
  while (query.next())
    if (const auto hour = decode_summary(query.bytes(0)))
      for (std::size_t i = 0; i < hours.size(); ++i) hours[i].push_back((*hour)[i]);
  Summary summary;
  for (std::size_t i = 0; i < hours.size(); ++i)
    summary[i] = combine(hours[i], memory_s / (static_cast<double>(kHourNs) * 1e-9));
  return summary;
}

void put_summary(detail::Connection& connection, std::string_view table, std::int64_t axis,
                 std::int64_t start_ns, const Summary& summary) {
  const std::string bytes = encode_summary(summary);
  run(connection, fmt::format("INSERT OR REPLACE INTO {} VALUES (?, ?, ?)", table), axis, start_ns,
      std::span<const std::byte>(std::as_bytes(std::span(bytes))));
}

}  // namespace

Upkeep Store::Impl::upkeep(std::int64_t now_ns) {
  if (move_ || move_is_due(now_ns)) {
    move_rows(now_ns);
    return {true, over_limit_};
  }
  if (settle_hour(now_ns)) return {true, over_limit_};
  Upkeep done{false, over_limit_};
  if (!retaining_ && retained_ns_ && now_ns - *retained_ns_ < kRetainEveryNs && now_ns >= *retained_ns_)
    return done;
  retained_ns_ = now_ns;
  done.over_limit = false;
  done.more = remove_aged(now_ns) || remove_for_size(now_ns, done.over_limit) || give_space_back();
  retaining_ = done.more;
  over_limit_ = done.over_limit;
  return done;
}

bool Store::Impl::move_is_due(std::int64_t now_ns) {
  if (!fresh_) {
    Query query(connection_, "SELECT count(*) FROM fresh");
    fresh_ = query.next() ? query.integer(0) : 0;
  }
  if (!moved_ns_ || now_ns < *moved_ns_) moved_ns_ = now_ns;
  if (*fresh_ == 0) return false;
  Move move;
  std::int64_t axes = 0;
  Query query(connection_,
              "SELECT (SELECT max(id) FROM fresh), (SELECT max(id) FROM axes), (SELECT count(*) FROM axes)");
  if (query.next()) {
    move.last_id = query.integer(0);
    move.last_axis = query.integer(1);
    axes = query.integer(2);
  }
  if (*fresh_ < kMoveRowsPerAxis * axes && now_ns - *moved_ns_ < kMoveEveryNs) return false;
  move.axes_per_step = std::max<std::int64_t>(1, kMoveRowsPerStep * axes / *fresh_);
  move_ = move;
  return true;
}

/// Rows stay in `fresh` until all have reached their place; killed in between, they are moved again.
void Store::Impl::move_rows(std::int64_t now_ns) {
  Transaction transaction(connection_, Transaction::Kind::write);
  Move next = *move_;
  std::int64_t removed = 0;
  const bool ends = next.next_axis > next.last_axis;
  if (ends) {
    removed = run(connection_, "DELETE FROM fresh WHERE id <= ?", next.last_id);
  } else {
    const std::int64_t end = next.next_axis + next.axes_per_step;
    run(connection_,
        "INSERT OR IGNORE INTO rows SELECT axis, time_ns, sample, data FROM fresh "
        "WHERE id <= ? AND axis >= ? AND axis < ? ORDER BY axis, time_ns, sample",
        next.last_id, next.next_axis, end);
    run(connection_,
        "INSERT OR IGNORE INTO unsettled_hours SELECT DISTINCT axis, time_ns - (time_ns % ?1 + ?1) % ?1 FROM "
        "fresh "
        "WHERE id <= ?2 AND axis >= ?3 AND axis < ?4",
        kHourNs, next.last_id, next.next_axis, end);
    next.next_axis = end;
  }
  transaction.commit();
  if (!ends) {
    move_ = next;
    return;
  }
  *fresh_ -= removed;
  move_.reset();
  moved_ns_ = now_ns;
}

bool Store::Impl::settle_hour(std::int64_t now_ns) {
  std::int64_t axis = 0, start_ns = 0;
  {
    Query query(connection_, "SELECT axis, start_ns FROM unsettled_hours WHERE start_ns <= ? LIMIT 1",
                now_ns - kHourNs - kSettleAfterNs);
    if (!query.next()) return false;
    axis = query.integer(0);
    start_ns = query.integer(1);
  }
  Transaction transaction(connection_, Transaction::Kind::write);
  const double memory_s = memory_of(connection_, axis);
  const auto all = summaries_of_hour(connection_, axis, start_ns, memory_s);
  for (const auto& [part_ns, summary] : all.five_minutes)
    put_summary(connection_, "five_minutes", axis, part_ns, summary);
  put_summary(connection_, "hours", axis, start_ns, all.hour);
  const std::int64_t day = start_of(start_ns, kDayNs);
  put_summary(connection_, "days", axis, day, summary_of_day(connection_, axis, day, memory_s));
  run(connection_, "DELETE FROM unsettled_hours WHERE axis = ? AND start_ns = ?", axis, start_ns);
  transaction.commit();
  return true;
}

bool Store::Impl::remove_aged(std::int64_t now_ns) {
  const Retention& keep = options.retention;
  return remove_rows(before(now_ns, keep.rows_s)) ||
         remove_summaries("five_minutes", before(now_ns, keep.five_minutes_s)) ||
         remove_summaries("hours", before(now_ns, keep.hours_s)) ||
         remove_summaries("days", before(now_ns, keep.days_s)) ||
         doom_evidence(before(now_ns, keep.evidence_s)) || forget_delivered(before(now_ns, keep.delivered_s));
}

/// What is needed to see the present stays: two hours of rows, a day of five minutes and of hours. Much
/// evidence, as outages leave it, must not drive out all trends: what it takes beyond half goes first.
bool Store::Impl::remove_for_size(std::int64_t now_ns, bool& over_limit) {
  const std::uint64_t limit = options.retention.bytes;
  if (limit == 0 || used_bytes() <= limit) return false;
  if ((evidence_bytes() > limit / 2 && doom_evidence(now_ns)) || remove_rows(now_ns - 2 * kHourNs) ||
      remove_summaries("five_minutes", now_ns - kDayNs) || remove_summaries("hours", now_ns - kDayNs) ||
      doom_evidence(now_ns))
    return true;
  over_limit = true;
  return false;
}

/// One hour of the axis with the oldest rows, unless its statistics are still to be made.
bool Store::Impl::remove_rows(std::int64_t before_ns) {
  std::int64_t axis = 0, end_ns = 0;
  {
    Query query(connection_,
                "SELECT id, hour FROM (SELECT id, oldest - (oldest % ?1 + ?1) % ?1 AS hour FROM (SELECT id, "
                "(SELECT min(time_ns) FROM rows WHERE axis = axes.id) AS oldest FROM axes) "
                "WHERE oldest IS NOT NULL) AS old WHERE hour + ?1 <= ?2 AND NOT EXISTS "
                "(SELECT 1 FROM unsettled_hours AS u WHERE u.axis = old.id AND u.start_ns = old.hour) "
                "ORDER BY hour LIMIT 1",
                kHourNs, before_ns);
    if (!query.next()) return false;
    axis = query.integer(0);
    end_ns = query.integer(1) + kHourNs;
  }
  Transaction transaction(connection_, Transaction::Kind::write);
  run(connection_, "DELETE FROM rows WHERE axis = ? AND time_ns < ?", axis, end_ns);
  run(connection_, "UPDATE axes SET rows_from = max(rows_from, ?) WHERE id = ?", end_ns, axis);
  transaction.commit();
  for (auto& [name, state] : axes_)
    if (state.id == axis) state.rows_from = std::max(state.rows_from, end_ns);
  return true;
}

/// Some days of the axis with the oldest.
bool Store::Impl::remove_summaries(std::string_view table, std::int64_t before_ns) {
  // Each hour that is settled makes its day anew of the hours that are there: those of the newest day stay.
  const std::string until =
      table == "hours" ? fmt::format("min(?, newest - (newest % {0} + {0}) % {0})", kDayNs) : "?";
  std::int64_t axis = 0, oldest_ns = 0, until_ns = 0;
  {
    Query query(connection_,
                fmt::format("SELECT id, oldest, {1} AS until FROM (SELECT id, "
                            "(SELECT min(start_ns) FROM {0} WHERE axis = axes.id) AS oldest, "
                            "(SELECT max(start_ns) FROM {0} WHERE axis = axes.id) AS newest FROM axes) "
                            "WHERE oldest < until ORDER BY oldest LIMIT 1",
                            table, until),
                before_ns);
    if (!query.next()) return false;
    axis = query.integer(0);
    oldest_ns = query.integer(1);
    until_ns = query.integer(2);
  }
  constexpr std::int64_t kAtOnceNs = 10 * kDayNs;
  Transaction transaction(connection_, Transaction::Kind::write);
  run(connection_, fmt::format("DELETE FROM {} WHERE axis = ? AND start_ns < ?", table), axis,
      std::min(until_ns, start_of(oldest_ns, kDayNs) + kAtOnceNs));
  transaction.commit();
  return true;
}

bool Store::Impl::doom_evidence(std::int64_t before_ns) {
  return run(connection_,
             "UPDATE evidence SET remove = 1 WHERE file = (SELECT file FROM evidence AS e WHERE NOT remove "
             "AND "
             "time_ns < ? AND NOT EXISTS (SELECT 1 FROM alarms WHERE id = e.alarm_id AND open) "
             "ORDER BY time_ns LIMIT 1)",
             before_ns) > 0;
}

bool Store::Impl::forget_delivered(std::int64_t before_ns) {
  return run(connection_,
             "DELETE FROM outbox WHERE key IN (SELECT key FROM outbox WHERE done_ns IS NOT NULL AND done_ns "
             "< ? "
             "LIMIT 500)",
             before_ns) > 0;
}

bool Store::Impl::give_space_back() {
  if (connection_.pragma("freelist_count") <= kFreePages) return false;
  run(connection_, fmt::format("PRAGMA incremental_vacuum({})", kReturnedPages));
  return true;
}

std::uint64_t Store::Impl::used_bytes() {
  const std::int64_t pages = connection_.pragma("page_count") - connection_.pragma("freelist_count");
  return static_cast<std::uint64_t>(pages * 4096) + evidence_bytes();
}

std::uint64_t Store::Impl::evidence_bytes() {
  Query query(connection_, "SELECT coalesce(sum(bytes), 0) FROM evidence WHERE NOT remove");
  return query.next() ? static_cast<std::uint64_t>(query.integer(0)) : 0;
}

}  // namespace resonid::monitor
