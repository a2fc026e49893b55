// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <signal.h>
#include <sqlite3.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <monitor/store/backlog.hpp>

#include "store_folder.hpp"

namespace resonid::monitor::test {
namespace {

Batch second_of(std::uint64_t sample) {
  Batch batch;
  for (int axis = 0; axis < 20; ++axis)
    batch.rows.push_back(record_of("axis" + std::to_string(axis),
                                   kStart + static_cast<std::int64_t>(sample) * kSecond, some_row(sample)));
  batch.events.push_back({"axis0", sample, "stiffness", "raise", "id", kStart, "text", "{}"});
  batch.snapshots.push_back(
      {"axis0", sample, sample, "1", "", std::vector<std::byte>(100'000, static_cast<std::byte>(sample))});
  return batch;
}

/// What stops writing, and lets it go on again.
class Space {
 public:
  virtual ~Space() = default;
  virtual std::string file() = 0;
  virtual void run_out() = 0;
  virtual void give_back() = 0;
};

/// A file system of 8 MB; needs root.
class SmallFileSystem final : public Space {
 public:
  explicit SmallFileSystem(const Folder& folder) : path_(folder.path()) {
    mounted_ = ::mount("tmpfs", path_.c_str(), "tmpfs", 0, "size=8m") == 0;
  }
  SmallFileSystem(const SmallFileSystem&) = delete;
  SmallFileSystem& operator=(const SmallFileSystem&) = delete;
  ~SmallFileSystem() override {
    if (mounted_) ::umount2(path_.c_str(), MNT_DETACH);
  }
  [[nodiscard]] bool mounted() const { return mounted_; }
  std::string file() override { return path_ + "/store.db"; }
  void run_out() override {
    std::ofstream ballast(path_ + "/ballast", std::ios::binary);
    const std::string piece(4096, 'x');
    while (ballast << piece << std::flush) {
    }
  }
  void give_back() override { std::filesystem::remove(path_ + "/ballast"); }

 private:
  std::string path_;
  bool mounted_ = false;
};

/// A bound on the size of this process' files.
class SmallFiles final : public Space {
 public:
  explicit SmallFiles(const Folder& folder) : file_(folder.file()) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = ::signal(SIGXFSZ, SIG_IGN);
  }
  SmallFiles(const SmallFiles&) = delete;
  SmallFiles& operator=(const SmallFiles&) = delete;
  ~SmallFiles() override {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, handler_);
  }
  std::string file() override { return file_; }
  void run_out() override { limit(300'000); }
  void give_back() override { limit(before_.rlim_cur); }

 private:
  void limit(::rlim_t bytes) {
    ::rlimit limits = before_;
    limits.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limits);
  }
  std::string file_;
  ::rlimit before_{};
  void (*handler_)(int) = nullptr;
};

void goes_on_after_a_full_disk(Space& space) {
  Store store = opened(space.file());
  Backlog backlog(1000);
  std::uint64_t sample = 0;
  const auto second = [&] {
    backlog.add(second_of(sample++));
    auto done = store.commit(backlog.batch());
    if (done) backlog.clear();
    return done;
  };
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(second());
  space.run_out();
  int failed = 0;
  for (int i = 0; i < 200; ++i) {
    const auto done = second();
    if (done) continue;
    ++failed;
    ASSERT_EQ(done.error().fault, StoreFault::full) << done.error().text;
    EXPECT_NE(done.error().text.find(space.file()), std::string::npos) << done.error().text;
    EXPECT_NE(done.error().text.find("free space"), std::string::npos) << done.error().text;
    static_cast<void>(store.upkeep(kStart + static_cast<std::int64_t>(sample) * kSecond));  // no harm either
  }
  EXPECT_GT(failed, 100);
  {
    auto reader = reader_of(space.file());  // what is there can be read meanwhile
    EXPECT_GE(value(reader.rows("axis3", kStart, kStart + kHour, 1000)).size(), 5U);
  }
  space.give_back();
  ASSERT_TRUE(second());
  auto reader = reader_of(space.file());
  EXPECT_EQ(value(reader.events("id", 1000)).size(), sample);
  EXPECT_GT(backlog.dropped_rows(), 0U);
  const auto rows = value(reader.rows("axis3", kStart, kStart + kHour, 1000));
  EXPECT_EQ(rows.back().row.sample, sample - 1);
  EXPECT_EQ(value(reader.snapshot("axis0"))->snapshot.sample, sample - 1);
}

TEST(StoreFaults, GoesOnAfterAFullFileSystem) {
  const Folder folder;
  SmallFileSystem space(folder);
  if (!space.mounted()) GTEST_SKIP() << "mounting a small file system needs root";
  goes_on_after_a_full_disk(space);
}

TEST(StoreFaults, GoesOnAfterFilesMayNotGrow) {
  const Folder folder;
  SmallFiles space(folder);
  goes_on_after_a_full_disk(space);
}

/// Log and database, as a killed process left them, are beyond the size that files may have.
TEST(StoreFaults, OpensWithoutWriting) {
  const Folder former, folder;
  StoreOptions options;
  options.program_version = "1";
  Store killed = opened(former.file(), options);
  for (std::uint64_t i = 0; i < 5; ++i) {
    Batch batch = second_of(i);
    for (const char* axis : {"axis1", "axis2", "axis3"}) {
      batch.snapshots.push_back(batch.snapshots[0]);
      batch.snapshots.back().axis = axis;
    }
    value(killed.commit(batch));
  }
  for (const char* part : {"", "-wal"})
    std::filesystem::copy_file(former.file() + part, folder.file() + part);
  SmallFiles space(folder);
  space.run_out();
  ASSERT_GT(std::filesystem::file_size(folder.file() + "-wal"), 300'000U);
  for (const char* version : {"1", "2"}) {
    options.program_version = version;
    Store store = opened(folder.file(), options);
    const auto full = store.commit(second_of(5));
    ASSERT_FALSE(full);
    EXPECT_EQ(full.error().fault, StoreFault::full) << full.error().text;
  }
  space.give_back();
  Store store = opened(folder.file(), options);
  EXPECT_EQ(value(store.commit(second_of(5))).rows, 20U);
}

TEST(StoreFaults, OpensOnAFileSystemWithoutRoomForItsLog) {
  const Folder folder;
  SmallFileSystem space(folder);
  if (!space.mounted()) GTEST_SKIP() << "mounting a small file system needs root";
  {
    Store store = opened(space.file());
    value(store.commit(second_of(0)));
  }
  EXPECT_EQ(std::filesystem::file_size(space.file() + "-wal"), 0U);  // nothing is hidden in it from a backup
  space.run_out();
  Store store = opened(space.file());
  ASSERT_FALSE(store.commit(second_of(1)));
  EXPECT_EQ(value(reader_of(space.file()).events("id", 10)).size(), 1U);
  space.give_back();
  EXPECT_EQ(value(store.commit(second_of(1))).rows, 20U);
}

TEST(StoreFaults, GoesOnAfterAnotherProgramsTransaction) {
  const Folder folder;
  StoreOptions options;
  options.busy_ms = 20;
  Store store = opened(folder.file(), options);
  ASSERT_TRUE(store.commit(second_of(0)));
  sqlite3* other = nullptr;
  ASSERT_EQ(sqlite3_open(folder.file().c_str(), &other), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(other, "BEGIN IMMEDIATE", nullptr, nullptr, nullptr), SQLITE_OK);
  const auto blocked = store.commit(second_of(1));
  ASSERT_FALSE(blocked);
  EXPECT_EQ(blocked.error().fault, StoreFault::locked) << blocked.error().text;
  sqlite3_close(other);
  EXPECT_EQ(value(store.commit(second_of(1))).rows, 20U);
}

TEST(StoreFaults, RefusesAFolderThatIsNotThereOrMayNotBeWritten) {
  const Folder folder;
  const auto absent = Store::open(folder.path() + "/no/store.db", {});
  ASSERT_FALSE(absent);
  EXPECT_NE(absent.error().text.find("/no/store.db"), std::string::npos) << absent.error().text;
  const auto forbidden = Store::open("/proc/store.db", {});
  ASSERT_FALSE(forbidden);
  EXPECT_FALSE(Reader::open(folder.file()));
  EXPECT_FALSE(std::filesystem::exists(folder.file()));  // reading makes none
}

TEST(StoreFaults, OneProcessWrites) {
  const Folder folder;
  Store store = opened(folder.file());
  const auto second = Store::open(folder.file(), {});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().fault, StoreFault::locked);
  EXPECT_NE(second.error().text.find("another process"), std::string::npos);
  EXPECT_TRUE(store.commit(second_of(0)));
}

TEST(StoreFaults, KnowsThatItsFileIsLost) {
  const Folder folder;
  const auto place = std::filesystem::path(folder.path()) / "data", aside = place.parent_path() / "aside";
  std::filesystem::create_directory(place);
  Store store = opened((place / "store.db").string());
  EXPECT_TRUE(store.commit(second_of(0)));
  EXPECT_EQ(store.lost(), "");
  std::filesystem::rename(place, aside);
  EXPECT_NE(store.lost().find("data/store.db' or its folder was removed or replaced"), std::string::npos);
  std::filesystem::create_directory(place);
  std::filesystem::copy_file(aside / "store.db", place / "store.db");  // of that name, but another one
  EXPECT_NE(store.lost(), "");
  std::filesystem::remove_all(place);
  std::filesystem::rename(aside, place);
  EXPECT_EQ(store.lost(), "");
}

std::string contents_of(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}
void overwrite(const std::string& file, std::size_t from, const std::string& bytes) {
  std::fstream stream(file, std::ios::binary | std::ios::in | std::ios::out);
  stream.seekp(static_cast<std::streamoff>(from));
  stream << bytes;
}

void make_full(const std::string& file) {
  Store store = opened(file);
  for (std::uint64_t i = 0; i < 200; ++i) value(store.commit(second_of(i)));
  keep_up(store, kStart + kHour);
}

TEST(StoreFaults, ADamagedFileIsRefusedAndLeftAlone) {
  const Folder folder;
  make_full(folder.file());
  const std::string garbage(20'000, '\x5a');
  overwrite(folder.file(), 0, garbage);
  const std::string damaged = contents_of(folder.file());
  const auto refused = Store::open(folder.file(), {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().fault, StoreFault::damaged);
  EXPECT_NE(refused.error().text.find("move '" + folder.file() + "', '" + folder.file() + "-wal'"),
            std::string::npos)
      << refused.error().text;
  EXPECT_EQ(contents_of(folder.file()), damaged);
}

TEST(StoreFaults, DamageInATableIsFoundAtTheStart) {
  const Folder folder;
  make_full(folder.file());
  const auto size = std::filesystem::file_size(folder.file());
  for (std::size_t at = 4096; at + 4096 <= size; at += 4096)
    overwrite(folder.file(), at, std::string(64, '\xa5'));
  const auto refused = Store::open(folder.file(), {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().fault, StoreFault::damaged) << refused.error().text;
}

TEST(StoreFaults, DamageWhileItRunsIsNamedAndEndsNothing) {
  const Folder folder;
  Store store = opened(folder.file());
  for (std::uint64_t i = 0; i < 50; ++i) value(store.commit(second_of(i)));
  keep_up(store, kStart + kHour);
  {
    // The writer's next rows find the end of `fresh` overwritten.
    sqlite3* other = nullptr;
    ASSERT_EQ(sqlite3_open(folder.file().c_str(), &other), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(other,
                           "PRAGMA wal_checkpoint(TRUNCATE); PRAGMA writable_schema=ON; "
                           "UPDATE sqlite_schema SET rootpage = 1000000 WHERE name = 'fresh';"
                           "PRAGMA schema_version=77",
                           nullptr, nullptr, nullptr),
              SQLITE_OK);
    sqlite3_close(other);
  }
  const auto done = store.commit(second_of(60));
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().fault, StoreFault::damaged) << done.error().text;
}

TEST(StoreFaults, FilesOfOtherProgramsAndLaterVersionsAreLeftAlone) {
  const Folder folder;
  const auto make = [&](const char* sql) {
    std::filesystem::remove(folder.file());
    sqlite3* other = nullptr;
    ASSERT_EQ(sqlite3_open(folder.file().c_str(), &other), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(other, sql, nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(other);
  };
  make("CREATE TABLE music (title TEXT)");
  auto refused = Store::open(folder.file(), {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().fault, StoreFault::newer);
  EXPECT_NE(refused.error().text.find("another program"), std::string::npos);

  std::filesystem::remove(folder.file());
  { Store store = opened(folder.file()); }
  sqlite3* other = nullptr;
  ASSERT_EQ(sqlite3_open(folder.file().c_str(), &other), SQLITE_OK);
  sqlite3_exec(other, "PRAGMA user_version=99", nullptr, nullptr, nullptr);
  sqlite3_close(other);
  refused = Store::open(folder.file(), {});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text.find("schema 99"), std::string::npos) << refused.error().text;
}

}  // namespace
}  // namespace resonid::monitor::test
