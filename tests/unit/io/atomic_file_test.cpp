// SPDX-License-Identifier: MIT
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <resonid/io/detail/atomic_file.hpp>

#include "temporary_folder.hpp"

namespace resonid::io {
namespace {

namespace fs = std::filesystem;
using test::contents_of;
using test::TemporaryFolder;

TEST(AtomicFile, WritesAndReplacesAndLeavesNothingElse) {
  const TemporaryFolder folder;
  const std::string first(100'000, 'a');
  ASSERT_TRUE(write_file_atomically(folder / "result.json", first));
  EXPECT_EQ(contents_of(folder / "result.json"), first);
  ASSERT_TRUE(write_file_atomically(folder / "result.json", "short"));
  EXPECT_EQ(contents_of(folder / "result.json"), "short");
  EXPECT_EQ(folder.entries(), 1U);
}

TEST(AtomicFile, KeepsPermissionsOfAnExistingFile) {
  const TemporaryFolder folder;
  const fs::path path = folder.file("result.json", "old");
  const auto wanted = fs::perms::owner_read | fs::perms::owner_write | fs::perms::others_read;
  fs::permissions(path, wanted);
  ASSERT_TRUE(write_file_atomically(path, "new"));
  EXPECT_EQ(fs::status(path).permissions(), wanted);
}

TEST(AtomicFile, AProgramThatIsEndedLeavesNothing) {
  const TemporaryFolder folder;
  const fs::path kept = folder.file("kept.json", "old");
  const auto end = [&] {
    auto first = AtomicFile::create(kept), second = AtomicFile::create(folder / "second.csv");
    ASSERT_TRUE(first && second && first->write("new") && second->write("1,2\n"));
    ASSERT_EQ(folder.entries(), 3U);
    remove_unfinished_files();
    ::_exit(7);
  };
  EXPECT_EXIT(end(), ::testing::ExitedWithCode(7), "");
  EXPECT_EQ(contents_of(kept), "old");
  EXPECT_EQ(folder.entries(), 1U);
}

TEST(AtomicFile, FollowsASymbolicLink) {
  const TemporaryFolder folder;
  const fs::path path = folder.file("real.json", "old");
  fs::create_symlink("real.json", folder / "link.json");
  ASSERT_TRUE(write_file_atomically(folder / "link.json", "new"));
  EXPECT_TRUE(fs::is_symlink(folder / "link.json"));
  EXPECT_EQ(contents_of(path), "new");
}

TEST(AtomicFile, WritesADeviceInPlace) {
  ASSERT_TRUE(write_file_atomically("/dev/null", "gone"));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST(AtomicFile, NamesAMissingFolder) {
  const TemporaryFolder folder;
  const auto result = write_file_atomically(folder / "absent/result.json", "x");
  RESONID_EXPECT_MESSAGE(result, "absent/result.json: cannot write: there is no folder '");
  EXPECT_EQ(folder.entries(), 0U);
}

TEST(AtomicFile, RefusesAFolderAsTarget) {
  const TemporaryFolder folder;
  RESONID_EXPECT_MESSAGE(write_file_atomically(folder.path(), "x"), "this is a folder, a file is required");
  const fs::path file = folder.file("plain", "");
  RESONID_EXPECT_MESSAGE(write_file_atomically(file / "x.json", "x"), "is not a folder");
  RESONID_EXPECT_MESSAGE(write_file_atomically("", "x"), "the file name is empty");
}

TEST(AtomicFile, TellsBeforeWritingWhatItWouldRefuse) {
  const TemporaryFolder folder;
  EXPECT_TRUE(check_writable(folder / "new.json"));
  EXPECT_TRUE(check_writable(folder.file("old.json", "old")));
  EXPECT_TRUE(check_writable("/dev/null"));
  EXPECT_TRUE(check_writable("name_without_a_folder.json"));
  RESONID_EXPECT_MESSAGE(check_writable(folder / "absent/new.json"), "there is no folder '");
  RESONID_EXPECT_MESSAGE(check_writable(folder / "old.json/new.json"), "is not a folder");
  RESONID_EXPECT_MESSAGE(check_writable(folder.path()), "this is a folder, a file is required");
  EXPECT_EQ(contents_of(folder / "old.json"), "old");
  EXPECT_EQ(folder.entries(), 1U);
}

TEST(AtomicFile, ReportsMissingPermission) {
  if (::geteuid() == 0) GTEST_SKIP() << "runs as root, for whom no folder is closed";
  const TemporaryFolder folder;
  fs::permissions(folder.path(), fs::perms::owner_read | fs::perms::owner_exec);
  RESONID_EXPECT_MESSAGE(write_file_atomically(folder / "x.json", "x"), "Permission denied");
  RESONID_EXPECT_MESSAGE(check_writable(folder / "x.json"), "Permission denied");
}

TEST(AtomicFile, WritesAFileWithTheLongestName) {
  const TemporaryFolder folder;
  const std::string name(255, 'n');
  ASSERT_TRUE(write_file_atomically(folder / name, "x"));
  EXPECT_EQ(contents_of(folder / name), "x");
}

TEST(AtomicFile, LeavesTheOldFileAndNoTemporaryWhenWritingFails) {
  const TemporaryFolder folder;
  const fs::path path = folder.file("result.json", "old");
  ::rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  auto* const handler = std::signal(SIGXFSZ, SIG_IGN);
  const ::rlimit small{4096, before.rlim_max};  // the disk is "full" after 4096 bytes
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const auto result = write_file_atomically(path, std::string(10'000, 'x'));
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  RESONID_EXPECT_MESSAGE(result, "result.json: cannot write: File too large");
  EXPECT_EQ(contents_of(path), "old");
  EXPECT_EQ(folder.entries(), 1U);
}

TEST(AtomicFile, PieceByPieceAppearsWithCommitOnly) {
  const TemporaryFolder folder;
  const fs::path path = folder.file("rows.csv", "old");
  {
    auto abandoned = AtomicFile::create(path);
    ASSERT_TRUE(abandoned);
    ASSERT_TRUE(abandoned->write("half"));
    EXPECT_EQ(folder.entries(), 2U);
  }
  EXPECT_EQ(contents_of(path), "old");
  EXPECT_EQ(folder.entries(), 1U);
  auto file = AtomicFile::create(path);
  ASSERT_TRUE(file);
  auto moved = std::move(*file);
  for (const char* piece : {"a,", "b\n", ""}) ASSERT_TRUE(moved.write(piece));
  EXPECT_EQ(contents_of(path), "old");
  ASSERT_TRUE(moved.commit());
  EXPECT_EQ(contents_of(path), "a,b\n");
  EXPECT_EQ(folder.entries(), 1U);
}

TEST(AtomicFile, PieceByPieceRefusesWhatWritingAtOnceRefuses) {
  const TemporaryFolder folder;
  EXPECT_FALSE(AtomicFile::create(folder / "missing/rows.csv"));
  EXPECT_FALSE(AtomicFile::create(fs::temp_directory_path()));
  auto device = AtomicFile::create("/dev/full");
  ASSERT_TRUE(device);
  EXPECT_FALSE(device->write("x"));
}

}  // namespace
}  // namespace resonid::io
