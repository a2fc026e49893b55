// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <resonid/io/detail/sha256.hpp>
#include <string>

#include "temporary_folder.hpp"

namespace resonid::io {
namespace {

std::string digest(std::string_view text) {
  Sha256 sha;
  sha.add(text);
  return sha.hexadecimal();
}

// The examples of NIST's "SHA-256" in the Cryptographic Standards and Guidelines (FIPS 180-4), and
// `printf '' | sha256sum`.
TEST(Sha256, IsThatOfTheStandardsExamples) {
  EXPECT_EQ(digest(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(digest("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(digest("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

// `head -c N /dev/zero | tr '\\0' a | sha256sum`: lengths around the padding's edges, and a million.
TEST(Sha256, PadsEveryLength) {
  EXPECT_EQ(digest(std::string(55, 'a')), "9f4390f8d30c2dd92ec9f095b65e2b9ae9b0a925a5258e241c9f1e910f734318");
  EXPECT_EQ(digest(std::string(56, 'a')), "b35439a4ac6f0948b6d6f9e3c6af0f5f590ce20f1bde7090ef7970686ec6738a");
  EXPECT_EQ(digest(std::string(64, 'a')), "ffe054fe7ae0cb6dc65c3af9b61d5209f439851db43d0ba5997337df154668eb");
  EXPECT_EQ(digest(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, DoesNotDependOnThePieces) {
  const std::string text(1000, 'q');
  for (const std::size_t piece : {1U, 63U, 64U, 65U, 999U}) {
    Sha256 sha;
    for (std::size_t at = 0; at < text.size(); at += piece) sha.add(std::string_view(text).substr(at, piece));
    EXPECT_EQ(sha.hexadecimal(), digest(text)) << piece;
  }
}

TEST(Sha256, ReadsFilesAndNothingElse) {
  const test::TemporaryFolder folder;
  const std::string contents(70000, 'x');  // more than is read at once
  EXPECT_EQ(sha256_of_file(folder.file("a.csv", contents).string()), digest(contents));
  EXPECT_EQ(sha256_of_file((folder / "none.csv").string()), std::nullopt);
  EXPECT_EQ(sha256_of_file("-"), std::nullopt);
  EXPECT_EQ(sha256_of_file("/dev/null"), std::nullopt);
}

}  // namespace
}  // namespace resonid::io
