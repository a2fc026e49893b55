// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <limits>
#include <monitor/store/row_codec.hpp>
#include <monitor/store/store_impl.hpp>
#include <resonid/io/detail/sha256.hpp>
#include <system_error>
#include <utility>

namespace resonid::monitor {
namespace {

using detail::Connection;
using detail::Query;
using detail::run;
using detail::SqliteFailure;
using detail::Transaction;

constexpr int kFrameBytes = 4096 + 24;                           // page and header in the log
constexpr int kQuietCheckpointPages = 16'000'000 / kFrameBytes;  // from here on copied without waiting
constexpr int kRetryPages = 1'000'000 / kFrameBytes;

bool storable(std::uint64_t sample) {
  return sample <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
}

/// Some room is left for hours and days around it.
bool storable_time(std::int64_t time_ns) {
  constexpr std::int64_t kFarthestNs = 9'000'000'000'000'000'000;
  return time_ns > -kFarthestNs && time_ns < kFarthestNs;
}

std::span<const std::byte> bytes_of(const std::vector<std::byte>& bytes) { return bytes; }
std::span<const std::byte> bytes_of(std::string_view bytes) { return std::as_bytes(std::span(bytes)); }

std::uint64_t size_of(const std::string& path) {
  std::error_code code;
  const auto size = std::filesystem::file_size(path, code);
  return code ? 0 : size;
}

int note_wal_pages(void* pages, sqlite3*, const char*, int count) {
  *static_cast<int*>(pages) = count;
  return SQLITE_OK;
}

}  // namespace

std::string configuration_hash(std::string_view text) {
  io::Sha256 hash;
  hash.add(text);
  return hash.hexadecimal();
}

Store::Impl::Lock::Lock(const std::string& path)
    : descriptor_(::open((path + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
  if (descriptor_ >= 0 && ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return;
  const int code = errno;
  if (descriptor_ >= 0) ::close(descriptor_);
  if (descriptor_ >= 0 && code == EWOULDBLOCK)
    throw SqliteFailure(
        StoreFault::locked,
        fmt::format("'{}' is written by another process; end it, or name another folder", path));
  throw SqliteFailure(
      code == EACCES || code == EROFS ? StoreFault::read_only
      : code == ENOSPC                ? StoreFault::full
                                      : StoreFault::input_output,
      fmt::format("'{}.lock' cannot be written: {}", path, std::generic_category().message(code)));
}

Store::Impl::Lock::~Lock() { ::close(descriptor_); }

Connection Store::Impl::open_checked(const std::string& path, const StoreOptions& options) {
  Connection connection(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, options.busy_ms);
  detail::prepare_schema(connection, path, options.program_version);
  detail::check_quickly(connection, path, options.quick_check_s);
  return connection;
}

Store::Impl::Impl(std::string file, const StoreOptions& wanted)
    : options(wanted), path(std::move(file)), lock_(path), connection_(open_checked(path, options)) {
  sqlite3_wal_hook(connection_.handle(), note_wal_pages, &wal_pages_);
}

/// The log stays as an empty file: one with pages would be taken for part of a backup that is put in place.
Store::Impl::~Impl() {
  sqlite3_exec(connection_.handle(), "PRAGMA journal_size_limit=0", nullptr, nullptr, nullptr);
}

Store::Impl::AxisState& Store::Impl::axis(const std::string& name) {
  if (const auto known = axes_.find(name); known != axes_.end()) return known->second;
  run(connection_, "INSERT INTO axes (name) VALUES (?) ON CONFLICT DO NOTHING", name);
  Query query(connection_, "SELECT id, newest_sample, rows_from FROM axes WHERE name = ?", name);
  if (!query.next()) connection_.fail("reading an axis");
  return axes_[name] = {query.integer(0), query.integer(1), query.integer(2), false};
}

Committed Store::Impl::commit(const Batch& batch) {
  Committed done;
  Transaction transaction(connection_, Transaction::Kind::write);
  for (const auto& entry : batch.axes)
    run(connection_, "UPDATE axes SET memory_s = ? WHERE id = ?",
        std::isfinite(entry.memory_s) ? entry.memory_s : 0.0, axis(entry.axis).id);
  for (const auto& entry : batch.configurations)
    run(connection_, "INSERT INTO configurations VALUES (?, ?, ?) ON CONFLICT DO NOTHING",
        configuration_hash(entry.text), entry.text, entry.time_ns);
  write_rows(batch, done);
  for (const auto& entry : batch.snapshots) {
    if (storable(entry.sample) && storable(entry.position))
      write_snapshot(entry);
    else
      ++done.refused;
  }
  for (const auto& entry : batch.positions) {
    const auto word = [&entry](std::size_t i) { return std::bit_cast<std::int64_t>(entry.word[i]); };
    run(connection_, "INSERT OR REPLACE INTO positions VALUES (?, ?, ?, ?, ?, ?, ?)", axis(entry.axis).id,
        std::bit_cast<std::int64_t>(entry.next_sample), std::bit_cast<std::int64_t>(entry.sender_offset),
        word(0), word(1), word(2), word(3));
  }
  write_alarms(batch, done);
  write_people(batch, done);
  write_outbox(batch, done);
  transaction.commit();
  if (fresh_) *fresh_ += static_cast<std::int64_t>(done.rows);
  checkpoint_if_due();
  return done;
}

void Store::Impl::write_rows(const Batch& batch, Committed& done) {
  for (const auto& entry : batch.rows) {
    if (!storable(entry.row.sample) || !storable_time(entry.time_ns)) {
      ++done.refused;
      continue;
    }
    AxisState& state = axis(entry.axis);
    const auto sample = static_cast<std::int64_t>(entry.row.sample);
    if (sample <= state.newest_sample) {
      ++done.known_rows;
      continue;
    }
    state.newest_sample = sample;
    state.changed = true;
    if (entry.time_ns < state.rows_from) {
      ++done.expired_rows;
      continue;
    }
    const std::string bytes = encode_row(entry.row);
    run(connection_, "INSERT INTO fresh (axis, time_ns, sample, data) VALUES (?, ?, ?, ?)", state.id,
        entry.time_ns, sample, bytes_of(std::string_view(bytes)));
    ++done.rows;
  }
  for (auto& [name, state] : axes_) {
    if (!std::exchange(state.changed, false)) continue;
    run(connection_, "UPDATE axes SET newest_sample = ? WHERE id = ?", state.newest_sample, state.id);
  }
}

/// The older of two is overwritten. One that is not newer comes from a replay: it is written only where the
/// newest is damaged, over that one. Those of another configuration or version go, however new they are:
/// their axis has begun anew, and at an earlier sample.
void Store::Impl::write_snapshot(const SnapshotRecord& snapshot) {
  const std::int64_t id = axis(snapshot.axis).id;
  run(connection_, "DELETE FROM snapshots WHERE axis = ? AND (configuration <> ? OR version <> ?)", id,
      snapshot.configuration_hash, snapshot.version);
  std::int64_t slot = 0;
  {
    Query query(connection_,
                "SELECT slot, sample, crc, data FROM snapshots WHERE axis = ? ORDER BY sample DESC LIMIT 1",
                id);
    if (query.next()) {
      const bool newer = static_cast<std::int64_t>(snapshot.sample) > query.integer(1);
      if (!newer && detail::crc_of(query.bytes(3)) == query.integer(2)) return;
      slot = newer ? 1 - query.integer(0) : query.integer(0);
    }
  }
  const auto data = bytes_of(snapshot.bytes);
  run(connection_,
      "INSERT INTO snapshots VALUES (?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO UPDATE SET "
      "sample = excluded.sample, position = excluded.position, version = excluded.version, "
      "configuration = excluded.configuration, crc = excluded.crc, data = excluded.data",
      id, slot, snapshot.sample, snapshot.position, snapshot.version, snapshot.configuration_hash,
      detail::crc_of({reinterpret_cast<const char*>(data.data()), data.size()}), data);
}

void Store::Impl::write_alarms(const Batch& batch, Committed& done) {
  for (const auto& entry : batch.alarms) {
    if (!storable(entry.sample)) {
      ++done.refused;
      continue;
    }
    run(connection_,
        "INSERT INTO alarms (id, axis, alarm, sample, severity, active, acknowledged, latched, suppressed, "
        "open, "
        "shelved_until_ns, raised_ns, cleared_ns, json) "
        "VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14) "
        "ON CONFLICT (id) DO UPDATE SET sample = excluded.sample, severity = excluded.severity, "
        "active = excluded.active, acknowledged = excluded.acknowledged, latched = excluded.latched, "
        "suppressed = excluded.suppressed, open = excluded.open, shelved_until_ns = "
        "excluded.shelved_until_ns, "
        "cleared_ns = excluded.cleared_ns, json = excluded.json WHERE excluded.sample >= alarms.sample OR "
        "?15",
        entry.id, axis(entry.axis).id, entry.alarm, entry.begins_anew ? std::uint64_t{0} : entry.sample,
        entry.severity, entry.active, entry.acknowledged, entry.latched, entry.suppressed, entry.open,
        entry.shelved_until_ns, entry.raised_ns, entry.cleared_ns, entry.json, entry.begins_anew);
  }
  for (const auto& entry : batch.events) {
    if (!storable(entry.sample)) {
      ++done.refused;
      continue;
    }
    const auto written =
        run(connection_,
            "INSERT INTO events (axis, sample, alarm, transition, alarm_id, time_ns, text, json, action) "
            "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO NOTHING",
            axis(entry.axis).id, entry.sample, entry.alarm, entry.transition, entry.alarm_id, entry.time_ns,
            entry.text, entry.json, std::bit_cast<std::int64_t>(entry.action));
    ++(written > 0 ? done.events : done.known_events);
  }
  for (const auto& entry : batch.evidence) {
    if (!storable(entry.to_sample) || !storable(entry.from_sample) || !storable(entry.bytes)) {
      ++done.refused;
      continue;
    }
    run(connection_,
        "INSERT INTO evidence (file, alarm_id, axis, from_sample, to_sample, time_ns, bytes) "
        "VALUES (?, ?, ?, ?, ?, ?, ?) ON CONFLICT (file) DO UPDATE SET from_sample = excluded.from_sample, "
        "to_sample = excluded.to_sample, bytes = excluded.bytes",
        entry.file, entry.alarm_id, axis(entry.axis).id, entry.from_sample, entry.to_sample, entry.time_ns,
        entry.bytes);
  }
  for (const auto& entry : batch.evidence_sizes)
    if (storable(entry.bytes))
      run(connection_, "UPDATE evidence SET bytes = ? WHERE file = ?", entry.bytes, entry.file);
  for (const auto& file : batch.evidence_removed)
    run(connection_, "DELETE FROM evidence WHERE file = ? AND remove", file);
  for (const auto& file : batch.evidence_lost) run(connection_, "DELETE FROM evidence WHERE file = ?", file);
}

void Store::Impl::write_people(const Batch& batch, Committed& done) {
  for (const auto& entry : batch.actions) {
    if (!storable(entry.sample)) {
      ++done.refused;
      continue;
    }
    done.actions += static_cast<std::uint64_t>(
        run(connection_,
            "INSERT INTO actions (key, axis, sample, time_ns, kind, who, reason, arguments) "
            "VALUES (?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO NOTHING",
            entry.key, axis(entry.axis).id, entry.sample, entry.time_ns, entry.kind, entry.who, entry.reason,
            entry.arguments));
  }
  for (const auto& entry : batch.baselines) {
    if (!storable(entry.sample)) {
      ++done.refused;
      continue;
    }
    const std::string figures = encode_row(entry.figures);
    run(connection_,
        "INSERT INTO baselines (axis, sample, time_ns, name, who, reason, figures, data) "
        "VALUES (?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO NOTHING",
        axis(entry.axis).id, entry.sample, entry.time_ns, entry.name, entry.who, entry.reason,
        bytes_of(std::string_view(figures)), bytes_of(entry.bytes));
  }
}

void Store::Impl::write_outbox(const Batch& batch, Committed& done) {
  for (const auto& entry : batch.outbox)
    if (run(connection_,
            "INSERT INTO outbox (key, target, payload, created_ns, next_ns) VALUES (?, ?, ?, ?, ?) "
            "ON CONFLICT DO NOTHING",
            entry.key, entry.target, entry.payload, entry.created_ns, entry.created_ns) == 0)
      done.known_messages.push_back(entry.key);
  for (const auto& entry : batch.deliveries) {
    if (entry.next_try_ns)  // a later try than the known one: said again, it changes nothing
      run(connection_,
          "UPDATE outbox SET tries = tries + 1, next_ns = ?1, text = ?2 "
          "WHERE key = ?3 AND done_ns IS NULL AND next_ns < ?1",
          *entry.next_try_ns, entry.text, entry.key);
    else
      run(connection_,
          std::string("UPDATE outbox SET tries = tries + 1, done_ns = ?, text = ?, payload = '' "
                      "WHERE done_ns IS NULL AND ") +
              (entry.all_of_target ? "target = ?" : "key = ?"),
          entry.time_ns, entry.text, entry.key);
  }
}

/// Copies the log into the file without waiting for readers; above its bound it is also emptied, which waits
/// a moment for them. A failure costs nothing: the commit is in the log, and the next one tries again.
void Store::Impl::checkpoint_if_due() noexcept {
  if (wal_pages_ < kQuietCheckpointPages / 2) next_checkpoint_pages_ = 0;  // begun anew
  const bool over = static_cast<std::uint64_t>(wal_pages_) * kFrameBytes > options.wal_bytes;
  if ((!over && wal_pages_ < kQuietCheckpointPages) || wal_pages_ < next_checkpoint_pages_) return;
  next_checkpoint_pages_ = wal_pages_ + kRetryPages;
  if (over)
    truncate_log();
  else
    sqlite3_wal_checkpoint_v2(connection_.handle(), nullptr, SQLITE_CHECKPOINT_PASSIVE, nullptr, nullptr);
}

void Store::Impl::truncate_log() noexcept {
  constexpr int kPatienceMs = 50;
  sqlite3_busy_timeout(connection_.handle(), kPatienceMs);
  if (sqlite3_wal_checkpoint_v2(connection_.handle(), nullptr, SQLITE_CHECKPOINT_TRUNCATE, nullptr,
                                nullptr) == SQLITE_OK)
    wal_pages_ = 0;
  sqlite3_busy_timeout(connection_.handle(), options.busy_ms);
}

std::string Store::Impl::lost() const {
  int moved = 0;
  if (sqlite3_file_control(connection_.handle(), "main", SQLITE_FCNTL_HAS_MOVED, &moved) != SQLITE_OK ||
      moved == 0)
    return {};
  return fmt::format(
      "'{}' or its folder was removed or replaced; put it back, or restart the service, which begins anew",
      path);
}

void Store::Impl::recover(StoreFault fault) noexcept {
  axes_.clear();
  fresh_.reset();
  move_.reset();
  if (fault == StoreFault::full) truncate_log();
}

Store::Store(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
Store::Store(Store&&) noexcept = default;
Store& Store::operator=(Store&&) noexcept = default;
Store::~Store() = default;

expected<Store, StoreError> Store::open(const std::string& path, const StoreOptions& options) {
  return detail::guarded([&] { return Store(std::make_unique<Impl>(path, options)); });
}

expected<Committed, StoreError> Store::commit(const Batch& batch) {
  auto done = detail::guarded([&] { return impl_->commit(batch); });
  if (!done) impl_->recover(done.error().fault);
  return done;
}

expected<Upkeep, StoreError> Store::upkeep(std::int64_t now_ns) {
  auto done = detail::guarded([&] { return impl_->upkeep(now_ns); });
  if (!done) impl_->recover(done.error().fault);
  return done;
}

void Store::set_retention(const Retention& retention) { impl_->options.retention = retention; }
std::string Store::lost() const { return impl_->lost(); }
std::uint64_t Store::file_bytes() const { return size_of(impl_->path); }
std::uint64_t Store::wal_bytes() const { return size_of(impl_->path + "-wal"); }

}  // namespace resonid::monitor
