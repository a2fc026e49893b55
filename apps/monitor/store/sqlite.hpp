// SPDX-License-Identifier: MIT
#pragma once

#include <sqlite3.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <monitor/store/store_error.hpp>
#include <optional>
#include <resonid/base/expected.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <unordered_map>
#include <utility>

namespace resonid::monitor::detail {

/// What SQLite refused. Thrown inside the store only; guarded() turns it into a StoreError.
class SqliteFailure : public std::runtime_error {
 public:
  SqliteFailure(StoreFault fault, const std::string& text) : std::runtime_error(text), fault_(fault) {}
  [[nodiscard]] StoreFault fault() const noexcept { return fault_; }

 private:
  StoreFault fault_;
};

/// One connection of one thread, with its prepared statements.
class Connection {
 public:
  /// `flags` as of sqlite3_open_v2(). Waits up to `busy_ms` for others.
  Connection(const std::string& path, int flags, int busy_ms);

  /// Statements without result and parameters, several separated by semicolons.
  void execute(const std::string& sql);
  /// Prepared once per text.
  [[nodiscard]] sqlite3_stmt* prepared(std::string_view sql);
  [[nodiscard]] std::int64_t changes() const noexcept { return sqlite3_changes64(handle_.get()); }
  [[nodiscard]] std::int64_t pragma(std::string_view name);
  [[nodiscard]] sqlite3* handle() const noexcept { return handle_.get(); }
  /// Throws what the last call on this connection met.
  [[noreturn]] void fail(std::string_view doing) const;

 private:
  struct Close {
    void operator()(sqlite3* handle) const noexcept { sqlite3_close_v2(handle); }
  };
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const noexcept { sqlite3_finalize(statement); }
  };
  std::string path_;
  std::unique_ptr<sqlite3, Close> handle_;
  std::unordered_map<std::string, std::unique_ptr<sqlite3_stmt, Finalize>> statements_;
};

/// A run of a prepared statement; reset at the end of its life. Not nested with another run of the same text.
class Query {
 public:
  template <class... Parameters>
  Query(Connection& connection, std::string_view sql, const Parameters&... parameters)
      : connection_(connection), statement_(connection.prepared(sql)) {
    int index = 0;
    (bind(++index, parameters, SQLITE_TRANSIENT), ...);
  }
  Query(const Query&) = delete;
  Query& operator=(const Query&) = delete;
  ~Query() {
    sqlite3_reset(statement_);
    sqlite3_clear_bindings(statement_);
  }

  /// Whether there is a next row.
  [[nodiscard]] bool next();
  [[nodiscard]] std::int64_t integer(int column) const noexcept {
    return sqlite3_column_int64(statement_, column);
  }
  [[nodiscard]] double real(int column) const noexcept { return sqlite3_column_double(statement_, column); }
  [[nodiscard]] bool null(int column) const noexcept {
    return sqlite3_column_type(statement_, column) == SQLITE_NULL;
  }
  /// Text or blob, valid until next().
  [[nodiscard]] std::string_view bytes(int column) const noexcept;
  [[nodiscard]] std::string text(int column) const { return std::string(bytes(column)); }
  [[nodiscard]] std::optional<std::int64_t> optional_integer(int column) const noexcept {
    return null(column) ? std::nullopt : std::optional(integer(column));
  }

 private:
  struct Unbound {};
  Query(Unbound, Connection& connection, std::string_view sql)
      : connection_(connection), statement_(connection.prepared(sql)) {}
  template <class... Parameters>
  friend std::int64_t run(Connection& connection, std::string_view sql, const Parameters&... parameters);

  template <class T>
  void bind(int index, const T& value, sqlite3_destructor_type lifetime) {
    int code = SQLITE_OK;
    if constexpr (std::is_same_v<T, std::optional<std::int64_t>>) {
      code = value ? sqlite3_bind_int64(statement_, index, *value) : sqlite3_bind_null(statement_, index);
    } else if constexpr (std::is_floating_point_v<T>) {
      code = sqlite3_bind_double(statement_, index, value);
    } else if constexpr (std::is_integral_v<T> || std::is_enum_v<T>) {
      code = sqlite3_bind_int64(statement_, index, static_cast<std::int64_t>(value));
    } else if constexpr (std::is_same_v<T, std::span<const std::byte>>) {
      code =
          sqlite3_bind_blob64(statement_, index, value.empty() ? "" : static_cast<const void*>(value.data()),
                              value.size(), lifetime);
    } else {
      const std::string_view text = value;
      code = sqlite3_bind_text64(statement_, index, text.empty() ? "" : text.data(), text.size(), lifetime,
                                 SQLITE_UTF8);
    }
    if (code != SQLITE_OK) connection_.fail("binding a parameter");
  }

  Connection& connection_;
  sqlite3_stmt* statement_;
};

/// Runs a statement to its end; how many rows it changed. Parameters are not copied.
template <class... Parameters>
std::int64_t run(Connection& connection, std::string_view sql, const Parameters&... parameters) {
  Query query(Query::Unbound{}, connection, sql);
  int index = 0;
  (query.bind(++index, parameters, SQLITE_STATIC), ...);
  while (query.next()) {
  }
  return connection.changes();
}

/// Ends with a rollback unless commit() was called.
class Transaction {
 public:
  enum class Kind { read, write };
  Transaction(Connection& connection, Kind kind);
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  ~Transaction();
  void commit();

 private:
  Connection& connection_;
  bool open_ = true;
};

/// What a person can do about a damaged database; begins with a semicolon.
[[nodiscard]] std::string remedy_of_damage(const std::string& path);

/// CRC-32 of a blob.
[[nodiscard]] std::int64_t crc_of(std::string_view bytes) noexcept;

/// What `work` returns, or why it could not. Nothing is thrown.
template <class Work>
[[nodiscard]] auto guarded(Work&& work) -> expected<std::invoke_result_t<Work>, StoreError> {
  try {
    if constexpr (std::is_void_v<std::invoke_result_t<Work>>) {
      work();
      return {};
    } else {
      return work();
    }
  } catch (const SqliteFailure& failure) {
    return unexpected<StoreError>(StoreError{failure.fault(), failure.what()});
  } catch (const std::exception& failure) {
    return unexpected<StoreError>(StoreError{StoreFault::input_output, failure.what()});
  }
}

}  // namespace resonid::monitor::detail
