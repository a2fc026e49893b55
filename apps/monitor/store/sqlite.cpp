// SPDX-License-Identifier: MIT
#include <fmt/core.h>
#include <zlib.h>

#include <cerrno>
#include <monitor/store/sqlite.hpp>
#include <system_error>

namespace resonid::monitor::detail {
namespace {

/// A full disk shows as SQLITE_FULL, or as a failed write, a failed fallocate() of the -shm file ... with an
/// errno that tells.
StoreFault fault_of(int code, int system) {
  if (system == ENOSPC || system == EDQUOT || system == EFBIG) return StoreFault::full;
  switch (code & 0xff) {
    case SQLITE_FULL:
      return StoreFault::full;
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return StoreFault::locked;
    case SQLITE_READONLY:
    case SQLITE_PERM:
      return StoreFault::read_only;
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return StoreFault::damaged;
    case SQLITE_TOOBIG:
    case SQLITE_CONSTRAINT:
    case SQLITE_MISMATCH:
      return StoreFault::invalid;
    default:
      return StoreFault::input_output;
  }
}

std::string requirement_of(StoreFault fault, const std::string& path) {
  switch (fault) {
    case StoreFault::full:
      return "; free space on that file system";
    case StoreFault::locked:
      return "; close the other program that writes it";
    case StoreFault::read_only:
      return "; it must be writable for this user";
    case StoreFault::damaged:
      return remedy_of_damage(path);
    default:
      return "";
  }
}

[[noreturn]] void fail_with(sqlite3* handle, int code, const std::string& path, std::string_view doing) {
  const int last = errno;
  // errno of SQLite is that of its last failed call, whenever that was: it counts for codes of the system
  // only.
  const bool by_system = (code & 0xff) == SQLITE_IOERR || (code & 0xff) == SQLITE_CANTOPEN;
  const int noted = handle != nullptr ? sqlite3_system_errno(handle) : 0;
  const int system = !by_system ? 0 : noted != 0 ? noted : last;
  const StoreFault fault = fault_of(code, system);
  std::string why = handle != nullptr ? sqlite3_errmsg(handle) : sqlite3_errstr(code);
  if (system != 0) why += fmt::format(" ({})", std::generic_category().message(system));
  throw SqliteFailure(fault, fmt::format("'{}' is {}, {}: {}{}", path, name_of(fault), doing, why,
                                         requirement_of(fault, path)));
}

}  // namespace

std::string remedy_of_damage(const std::string& path) {
  return fmt::format(
      "; stop the service and move '{0}', '{0}-wal' and '{0}-shm' to another folder, then start it with a "
      "backup in their place, or with none: it then begins anew",
      path);
}

Connection::Connection(const std::string& path, int flags, int busy_ms) : path_(path) {
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &handle, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  handle_.reset(handle);
  if (code != SQLITE_OK) fail_with(handle, code, path_, "opening it");
  sqlite3_extended_result_codes(handle, 1);
  sqlite3_busy_timeout(handle, busy_ms);
}

void Connection::execute(const std::string& sql) {
  errno = 0;
  if (sqlite3_exec(handle_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
    fail(sql.substr(0, sql.find('(')));
}

sqlite3_stmt* Connection::prepared(std::string_view sql) {
  auto& statement = statements_[std::string(sql)];
  if (!statement) {
    sqlite3_stmt* made = nullptr;
    if (sqlite3_prepare_v3(handle_.get(), sql.data(), static_cast<int>(sql.size()), SQLITE_PREPARE_PERSISTENT,
                           &made, nullptr) != SQLITE_OK)
      fail(fmt::format("preparing '{}'", sql));
    statement.reset(made);
  }
  return statement.get();
}

std::int64_t Connection::pragma(std::string_view name) {
  Query query(*this, fmt::format("PRAGMA {}", name));
  return query.next() ? query.integer(0) : 0;
}

void Connection::fail(std::string_view doing) const {
  fail_with(handle_.get(), sqlite3_extended_errcode(handle_.get()), path_, doing);
}

bool Query::next() {
  errno = 0;
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  const std::string_view sql = sqlite3_sql(statement_);
  connection_.fail(sql.substr(0, sql.find('(')));
}

std::string_view Query::bytes(int column) const noexcept {
  const void* data = sqlite3_column_blob(statement_, column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
  return data == nullptr ? std::string_view{} : std::string_view(static_cast<const char*>(data), size);
}

std::int64_t crc_of(std::string_view bytes) noexcept {
  return static_cast<std::int64_t>(::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

Transaction::Transaction(Connection& connection, Kind kind) : connection_(connection) {
  run(connection_, kind == Kind::write ? "BEGIN IMMEDIATE" : "BEGIN");
}

Transaction::~Transaction() {
  // Some faults have ended the transaction by themselves.
  if (open_ && sqlite3_get_autocommit(connection_.handle()) == 0)
    sqlite3_exec(connection_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void Transaction::commit() {
  run(connection_, "COMMIT");
  open_ = false;
}

}  // namespace resonid::monitor::detail
