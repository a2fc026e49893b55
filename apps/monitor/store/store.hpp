// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <monitor/store/records.hpp>
#include <monitor/store/store_error.hpp>
#include <resonid/base/expected.hpp>
#include <string>
#include <vector>

namespace resonid::monitor {

/// How long what is kept, in seconds of UNIX time; 0: for ever. Alarms, events, actions, baselines and
/// configurations stay.
struct Retention {
  double rows_s = 30.0 * 86400;
  double five_minutes_s = 365.0 * 86400;
  double hours_s = 10.0 * 365 * 86400;  ///< Those of an axis' newest day stay.
  double days_s = 0.0;
  double evidence_s = 365.0 * 86400;  ///< Of closed alarms.
  double delivered_s = 30.0 * 86400;  ///< Keys of delivered messages.
  /// Database, evidence and its reports. Evidence goes first while it takes more than half, then rows, five
  /// minutes, hours, and the rest of evidence.
  std::uint64_t bytes = 10'000'000'000;
};

struct StoreOptions {
  std::string program_version;
  Retention retention;
  int busy_ms = 2000;                    ///< So long another process may block.
  double quick_check_s = 0.5;            ///< Longest check at the start.
  std::uint64_t wal_bytes = 64'000'000;  ///< Above this the log is emptied.
};

/// What a commit wrote.
struct Committed {
  std::uint64_t rows = 0, known_rows = 0;
  std::uint64_t expired_rows = 0;  ///< Older than what retention has removed.
  std::uint64_t events = 0, known_events = 0;
  std::uint64_t actions = 0;
  std::uint64_t refused = 0;                ///< Records with a sample from 2^63 on; rows 285 years from 1970.
  std::vector<std::string> known_messages;  ///< Keys of the outbox that were there already.
};

/// What a step of upkeep did.
struct Upkeep {
  bool more = false;  ///< Another step has something to do.
  /// Nothing is left that may be removed, and Retention::bytes is exceeded; as of the newest look at that.
  bool over_limit = false;
};

/// The one writer of an installation's database, used by one thread. Readers (Reader) have connections of
/// their own. Nothing throws; after an error the store is as before the call, and the call may be repeated.
class Store {
 public:
  /// Makes the file if there is none. Refused: files of other programs, of later versions, damaged ones,
  /// and those that another process writes, which FILE.lock tells.
  [[nodiscard]] static expected<Store, StoreError> open(const std::string& path, const StoreOptions& options);
  Store(Store&&) noexcept;
  Store& operator=(Store&&) noexcept;
  ~Store();

  /// All of the batch, safe from power loss, or nothing. What is known already changes nothing.
  [[nodiscard]] expected<Committed, StoreError> commit(const Batch& batch);

  /// One small step of what keeps the file in order: rows to their place, statistics of ended hours and of
  /// the five minutes in them, retention, returning space. Called after each commit, again while there is
  /// more to do and time left. `now_ns`: UNIX.
  [[nodiscard]] expected<Upkeep, StoreError> upkeep(std::int64_t now_ns);

  void set_retention(const Retention& retention);

  /// Why nothing that is written from now on can be found again: the file, or its folder, was removed or
  /// replaced. SQLite itself goes on with what nobody can open any more. Empty: it is there.
  [[nodiscard]] std::string lost() const;

  /// Size of the database file and of its log.
  [[nodiscard]] std::uint64_t file_bytes() const;
  [[nodiscard]] std::uint64_t wal_bytes() const;

 private:
  class Impl;
  explicit Store(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;
};

}  // namespace resonid::monitor
