// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <monitor/store/reader_impl.hpp>
#include <monitor/store/schema.hpp>
#include <utility>

namespace resonid::monitor {
namespace {

using detail::kDayNs;
using detail::kFiveMinutesNs;
using detail::kHourNs;
using detail::Query;
using monitoring::Watched;

constexpr std::size_t kMostPoints = 100'000;
constexpr std::int64_t kRowNs = 1'000'000'000;            // one a second
constexpr std::int64_t kRowsSpanNs = 2 * kDayNs;          // by itself: a day of rows takes 0.1 s
constexpr std::int64_t kFiveMinutesSpanNs = 62 * kDayNs;  // likewise: of 18 000 summaries
constexpr std::int64_t kMostRowsSpanNs = 31 * kDayNs;     // even where it is asked for
constexpr std::int64_t kUnsettledNs = 2 * kDayNs;     // at most so much is made of rows that have no hour yet
constexpr std::uint32_t kStretchRows = 30;            // trusted, for a comparison
constexpr std::int64_t kStretchNs = 300'000'000'000;  // to either side, but what is compared does not overlap
constexpr std::int64_t kNearNs = 7 * kDayNs;          // farther stretches are not of that time any more

/// What stretches of one length are: their table, and their length.
struct Stretches {
  std::string_view table;
  std::int64_t length_ns;
};
Stretches stretches_of(Resolution resolution) {
  if (resolution == Resolution::five_minutes) return {"five_minutes", kFiveMinutesNs};
  if (resolution == Resolution::hour) return {"hours", kHourNs};
  return {"days", kDayNs};
}

std::optional<std::int64_t> first_of(detail::Connection& connection, std::string_view table,
                                     std::string_view column, std::int64_t axis) {
  Query query(connection, fmt::format("SELECT min({}) FROM {} WHERE axis = ?", column, table), axis);
  return query.next() ? query.optional_integer(0) : std::nullopt;
}

/// The finest that has the whole span, or all there is, and gives the points fast.
Resolution choose(detail::Connection& connection, std::int64_t axis, const HistoryQuery& query) {
  const std::int64_t span = query.to_ns - query.from_ns;
  const auto step = span / static_cast<std::int64_t>(query.points);
  const auto rows = first_of(connection, "rows", "time_ns", axis);
  const auto parts = first_of(connection, "five_minutes", "start_ns", axis);
  const auto hours = first_of(connection, "hours", "start_ns", axis);
  const auto days = first_of(connection, "days", "start_ns", axis);
  // A coarser record starts before the first finer one that is in it.
  const auto reaches = [&](const std::optional<std::int64_t>& first,
                           const std::optional<std::int64_t>& coarser, std::int64_t length_ns) {
    return !coarser || (first && (*first <= query.from_ns || *first < *coarser + length_ns));
  };
  if (span <= kRowsSpanNs && reaches(rows, hours, kHourNs)) return Resolution::row;
  if (span <= kFiveMinutesSpanNs && step < kHourNs && reaches(parts, hours, kHourNs))
    return Resolution::five_minutes;
  if ((step < kDayNs || !days) && reaches(hours, days, kDayNs)) return Resolution::hour;
  return Resolution::day;
}

/// Points of equal steps, from rows or from summaries that come in the order of time.
class Points {
 public:
  /// @param newest_ns of the rows: a stretch goes on until then
  Points(const HistoryQuery& query, double memory_s, std::int64_t step_ns, std::int64_t length_ns,
         std::int64_t newest_ns, History& history)
      : query_(query),
        memory_s_(memory_s),
        step_ns_(step_ns),
        length_ns_(length_ns),
        newest_ns_(newest_ns),
        history_(history) {
    gatherers_.resize(query.figures.size());
    parts_.resize(query.figures.size());
    history_.figures.resize(query.figures.size());
  }

  void add_row(std::int64_t time_ns, const RowBytes& row) {
    begin(time_ns, time_ns);
    for (std::size_t i = 0; i < gatherers_.size(); ++i)
      gatherers_[i].add(time_ns, row.figure(query_.figures[i]), row.trusted());
  }

  void add_summary(std::int64_t start_ns, const Summary& summary) {
    const std::int64_t there_ns =
        newest_ns_ > start_ns ? std::min(length_ns_, newest_ns_ - start_ns + kRowNs) : length_ns_;
    begin(std::max(start_ns, query_.from_ns), start_ns + there_ns / 2);
    for (std::size_t i = 0; i < parts_.size(); ++i)
      parts_[i].push_back(summary[static_cast<std::size_t>(query_.figures[i])]);
  }

  void end() {
    if (count_ == 0) return;
    history_.time_ns.push_back(first_ns_ + std::llround(after_first_ns_ / static_cast<double>(count_)));
    for (std::size_t i = 0; i < gatherers_.size(); ++i) {
      history_.figures[i].push_back(
          parts_[i].empty() ? gatherers_[i].summary(memory_s_)
                            : combine(parts_[i], memory_s_ / (static_cast<double>(length_ns_) * 1e-9)));
      gatherers_[i].clear();
      parts_[i].clear();
    }
    count_ = 0;
  }

 private:
  void begin(std::int64_t place_ns, std::int64_t time_ns) {
    const std::int64_t index = (place_ns - query_.from_ns) / step_ns_;
    if (index != index_) end();
    index_ = index;
    if (count_++ == 0) {
      first_ns_ = time_ns;
      after_first_ns_ = 0.0;
    }
    after_first_ns_ += static_cast<double>(time_ns - first_ns_);
  }

  const HistoryQuery& query_;
  double memory_s_;
  std::int64_t step_ns_, length_ns_;  // of a point, and of a summary
  std::int64_t newest_ns_;
  History& history_;
  std::int64_t index_ = -1, first_ns_ = 0;
  double after_first_ns_ = 0.0;
  std::size_t count_ = 0;
  std::vector<FigureGatherer> gatherers_;
  std::vector<std::vector<FigureSummary>> parts_;
};

/// Student's t is in the standard deviations already; both are taken for normal.
void judge(Difference& difference) {
  if (!difference.a || !difference.b) return;
  const FigureSummary &a = difference.a->summary, &b = difference.b->summary;
  difference.difference = b.mean - a.mean;
  difference.std = std::hypot(a.std, b.std);
  if (!(difference.std > 0.0)) return;
  difference.sigma = std::abs(difference.difference) / difference.std;
  difference.chance = std::erfc(difference.sigma / std::sqrt(2.0));
}

/// Whether both are made of the same rows in part: they are too close to each other to differ.
bool overlap(const Then& a, const Then& b) { return a.from_ns < b.to_ns && b.from_ns < a.to_ns; }

/// Figures about an instant: from rows within minutes, else from the nearest hour or day, all from the same
/// one, so that one time is right for all of them.
class Around {
 public:
  /// @param stretch_ns to either side
  Around(Reader::Impl& reader, AxisKey axis, std::int64_t time_ns, std::int64_t stretch_ns)
      : time_ns_(time_ns), stretch_ns_(stretch_ns) {
    from_rows(reader, axis);
    from_summaries(reader, axis, Resolution::hour);
    from_summaries(reader, axis, Resolution::day);
    keep_nearest();
  }
  [[nodiscard]] const std::optional<Then>& of(std::size_t figure) const { return found_[figure]; }

 private:
  void from_rows(Reader::Impl& reader, AxisKey axis) {
    std::array<FigureGatherer, monitoring::kWatched> figures;
    std::int64_t first_ns = time_ns_, last_ns = time_ns_;
    reader.visit_rows(axis.id, time_ns_ - stretch_ns_, time_ns_ + stretch_ns_,
                      [&](std::int64_t time_ns, std::uint64_t, const RowBytes& row) {
                        first_ns = std::min(first_ns, time_ns);
                        last_ns = std::max(last_ns, time_ns);
                        if (row.trusted())
                          for (std::size_t i = 0; i < figures.size(); ++i)
                            figures[i].add(time_ns, row.figure(static_cast<Watched>(i)), true);
                        return true;
                      });
    for (std::size_t i = 0; i < figures.size(); ++i) {
      const FigureSummary summary = figures[i].summary(axis.memory_s);
      if (summary.trusted >= kStretchRows) found_[i] = Then{summary, Resolution::row, first_ns, last_ns};
    }
  }

  void from_summaries(Reader::Impl& reader, AxisKey axis, Resolution resolution) {
    if (std::all_of(found_.begin(), found_.end(), [](const auto& then) { return then.has_value(); })) return;
    const auto [table, length] = stretches_of(resolution);
    std::array<std::optional<Then>, monitoring::kWatched> nearest;
    Query query(
        reader.connection,
        fmt::format("SELECT start_ns, data FROM {} WHERE axis = ? AND start_ns > ? AND start_ns < ?", table),
        axis.id, time_ns_ - kNearNs - length, time_ns_ + kNearNs);
    while (query.next()) {
      const auto summary = decode_summary(query.bytes(1));
      const std::int64_t start = query.integer(0);
      if (!summary) continue;
      for (std::size_t i = 0; i < nearest.size(); ++i) {
        if ((*summary)[i].trusted < kStretchRows) continue;
        if (nearest[i] && distance(nearest[i]->from_ns, length) <= distance(start, length)) continue;
        nearest[i] = Then{(*summary)[i], resolution, start, start + length};
      }
    }
    for (std::size_t i = 0; i < found_.size(); ++i)
      if (!found_[i]) found_[i] = nearest[i];
  }

  void keep_nearest() {
    // Of several that the instant is within, the finest.
    const auto rank = [this](const Then& then) {
      return std::pair(std::max({std::int64_t{0}, then.from_ns - time_ns_, time_ns_ - then.to_ns}),
                       then.resolution);
    };
    const auto nearest = std::min_element(found_.begin(), found_.end(), [&](const auto& a, const auto& b) {
      return a && (!b || rank(*a) < rank(*b));
    });
    const auto kept = *nearest;
    for (auto& then : found_)
      if (then && (then->from_ns != kept->from_ns || then->to_ns != kept->to_ns)) then.reset();
  }

  [[nodiscard]] std::int64_t distance(std::int64_t start_ns, std::int64_t length_ns) const {
    return std::abs(start_ns + length_ns / 2 - time_ns_);
  }

  std::int64_t time_ns_, stretch_ns_;
  std::array<std::optional<Then>, monitoring::kWatched> found_;
};

unexpected<StoreError> refused(std::string text) {
  return unexpected<StoreError>(StoreError{StoreFault::invalid, std::move(text)});
}

constexpr std::int64_t kFarthestQueryNs = 4'000'000'000'000'000'000;  // spans and neighbours are int64, too

/// Of hours in progress, which have no record yet.
void add_unsettled(Reader::Impl& reader, AxisKey axis, std::int64_t from_ns, std::int64_t length_ns,
                   const HistoryQuery& query, Points& points) {
  std::int64_t start = from_ns;
  std::array<FigureGatherer, monitoring::kWatched> figures;
  const auto end_stretch = [&] {
    Summary summary;
    std::uint32_t rows = 0;
    for (std::size_t i = 0; i < figures.size(); ++i) {
      summary[i] = figures[i].summary(axis.memory_s);
      rows += summary[i].rows;
      figures[i].clear();
    }
    if (rows > 0) points.add_summary(start, summary);
  };
  reader.visit_rows(
      axis.id, from_ns, query.to_ns, [&](std::int64_t time_ns, std::uint64_t, const RowBytes& row) {
        if (time_ns >= start + length_ns) {
          end_stretch();
          start = detail::start_of(time_ns, length_ns);
        }
        for (const Watched watched : query.figures)
          figures[static_cast<std::size_t>(watched)].add(time_ns, row.figure(watched), row.trusted());
        return true;
      });
  end_stretch();
}

}  // namespace

expected<History, StoreError> Reader::history(const HistoryQuery& query) {
  if (query.points < 1 || query.points > kMostPoints)
    return refused(fmt::format("points must be 1 ... {}, not {}", kMostPoints, query.points));
  if (query.from_ns >= query.to_ns) return refused("the end of a history must be later than its beginning");
  if (query.from_ns < -kFarthestQueryNs || query.to_ns > kFarthestQueryNs)
    return refused("a history lies between the years 1844 and 2096");
  if (query.resolution == Resolution::row && query.to_ns - query.from_ns > kMostRowsSpanNs)
    return refused("rows are read over at most 31 days; take five minutes, hours or days");
  return impl_->read([&] {
    History history;
    const auto axis = impl_->axis(query.axis);
    history.figures.resize(query.figures.size());
    if (!axis) return history;
    history.resolution = query.resolution.value_or(choose(impl_->connection, axis->id, query));
    const bool by_rows = history.resolution == Resolution::row;
    const auto count = static_cast<std::int64_t>(query.points);
    std::int64_t step = (query.to_ns - query.from_ns + count - 1) / count;
    const auto [table, length] = stretches_of(history.resolution);
    if (!by_rows) step = std::max(step, length);
    history.step_s = static_cast<double>(step) * 1e-9;
    std::int64_t last = query.from_ns;
    if (Query newest(impl_->connection,
                     "SELECT max((SELECT coalesce(max(time_ns), ?1) FROM rows WHERE axis = ?2), "
                     "(SELECT coalesce(max(time_ns), ?1) FROM fresh WHERE axis = ?2))",
                     query.from_ns, axis->id);
        newest.next())
      last = newest.integer(0);
    Points points(query, axis->memory_s, step, length, last, history);
    if (by_rows) {
      impl_->visit_rows(axis->id, query.from_ns, query.to_ns,
                        [&](std::int64_t time_ns, std::uint64_t, const RowBytes& row) {
                          points.add_row(time_ns, row);
                          return true;
                        });
    } else {
      Query stored(
          impl_->connection,
          fmt::format("SELECT start_ns, data FROM {} WHERE axis = ? AND start_ns > ? AND start_ns < ? "
                      "ORDER BY start_ns",
                      table),
          axis->id, query.from_ns - length, query.to_ns);
      std::int64_t end = query.from_ns;
      while (stored.next()) {
        end = stored.integer(0) + length;
        if (const auto summary = decode_summary(stored.bytes(1)))
          points.add_summary(stored.integer(0), *summary);
      }
      if (history.resolution != Resolution::day) {
        end = std::max(end, detail::start_of(last, kHourNs) - kUnsettledNs);
        if (end < query.to_ns)
          add_unsettled(*impl_, *axis, detail::start_of(end, length), length, query, points);
      }
    }
    points.end();
    return history;
  });
}

expected<std::vector<Difference>, StoreError> Reader::compare(std::string_view name, std::int64_t a_ns,
                                                              std::int64_t b_ns) {
  if (std::max(a_ns, b_ns) > kFarthestQueryNs || std::min(a_ns, b_ns) < -kFarthestQueryNs)
    return refused("times to compare lie between the years 1844 and 2096");
  return impl_->read([&] {
    std::vector<Difference> differences;
    const auto axis = impl_->axis(name);
    if (!axis) return differences;
    const std::int64_t stretch_ns = std::min(kStretchNs, std::abs(b_ns - a_ns) / 2);
    const Around a(*impl_, *axis, a_ns, stretch_ns), b(*impl_, *axis, b_ns, stretch_ns);
    for (std::size_t i = 0; i < monitoring::kWatched; ++i) {
      if (!a.of(i) && !b.of(i)) continue;
      if (a.of(i) && b.of(i) && overlap(*a.of(i), *b.of(i))) continue;
      Difference difference{static_cast<Watched>(i), a.of(i), b.of(i)};
      judge(difference);
      differences.push_back(std::move(difference));
    }
    return differences;
  });
}

}  // namespace resonid::monitor
