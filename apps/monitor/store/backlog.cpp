// SPDX-License-Identifier: MIT
#include <algorithm>
#include <iterator>
#include <map>
#include <monitor/store/backlog.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace resonid::monitor {
namespace {

template <class Records>
void append(Records& all, Records&& more) {
  all.insert(all.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

/// Of each name the last stays.
template <class Record>
void append_newest(std::vector<Record>& all, std::vector<Record>&& more, std::string Record::*name) {
  append(all, std::move(more));
  std::set<std::string> seen;
  std::vector<Record> kept;
  for (auto record = all.rbegin(); record != all.rend(); ++record)
    if (seen.insert((*record).*name).second) kept.push_back(std::move(*record));
  std::reverse(kept.begin(), kept.end());
  all = std::move(kept);
}

}  // namespace

void Backlog::add(Batch&& batch) {
  empty_ = false;
  append_newest(batch_.axes, std::move(batch.axes), &AxisRecord::axis);
  append(batch_.configurations, std::move(batch.configurations));
  append(batch_.rows, std::move(batch.rows));
  append_newest(batch_.snapshots, std::move(batch.snapshots), &SnapshotRecord::axis);
  append_newest(batch_.positions, std::move(batch.positions), &PositionRecord::axis);
  append(batch_.alarms, std::move(batch.alarms));
  append(batch_.events, std::move(batch.events));
  append(batch_.actions, std::move(batch.actions));
  append(batch_.baselines, std::move(batch.baselines));
  append(batch_.evidence, std::move(batch.evidence));
  append(batch_.evidence_sizes, std::move(batch.evidence_sizes));
  append(batch_.evidence_removed, std::move(batch.evidence_removed));
  append(batch_.evidence_lost, std::move(batch.evidence_lost));
  append(batch_.outbox, std::move(batch.outbox));
  append(batch_.deliveries, std::move(batch.deliveries));
  while (batch_.rows.size() > most_rows_) thin_rows();
}

/// Every second row of each axis stays, its newest one among them.
void Backlog::thin_rows() {
  std::map<std::string, bool, std::less<>> keeps;
  auto& rows = batch_.rows;
  std::size_t kept = rows.size();
  for (std::size_t i = rows.size(); i-- > 0;) {  // from the newest on; the kept ones gather at the end
    bool& keep = keeps.try_emplace(rows[i].axis, false).first->second;
    keep = !keep;
    if (keep && --kept != i) rows[kept] = std::move(rows[i]);
  }
  // With an axis for each row nothing would go.
  if (kept == 0) kept = rows.size() - most_rows_;
  dropped_rows_ += kept;
  rows.erase(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(kept));
}

void Backlog::clear() {
  batch_ = {};
  empty_ = true;
}

}  // namespace resonid::monitor
