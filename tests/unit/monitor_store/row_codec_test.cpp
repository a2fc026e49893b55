// SPDX-License-Identifier: MIT
#include <monitor/store/row_codec.hpp>

#include "store_folder.hpp"

namespace resonid::monitor::test {
namespace {

TEST(RowCodec, GivesEveryBitBack) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 20'000; ++i) {
    const auto row = any_row(random);
    const std::string bytes = encode_row(row);
    const auto back = RowBytes::of(bytes);
    ASSERT_TRUE(back);
    ASSERT_TRUE(same_bits(back->row(row.sample), row));
    ASSERT_EQ(back->trusted(), row.trusted);
    const auto watched = static_cast<monitoring::Watched>(random() % monitoring::kWatched);
    ASSERT_TRUE(same_bits(back->figure(watched).value, row[watched].value));
    ASSERT_TRUE(same_bits(back->figure(watched).std, row[watched].std));
  }
}

TEST(RowCodec, TakesEightBytesForEachNumber) {
  EXPECT_EQ(encode_row(monitoring::Row{}).size(), 8U);
  EXPECT_EQ(encode_row(some_row(7)).size(), 8U + 5U * 8U);
}

TEST(RowCodec, RefusesBytesThatAreNoRow) {
  std::mt19937_64 random(2);
  const std::string bytes = encode_row(some_row(1));
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(RowBytes::of(std::string_view(bytes).substr(0, size)));
  EXPECT_FALSE(RowBytes::of(bytes + "x"));
  for (int i = 0; i < 20'000; ++i) {  // any bytes: refused, or a row of their size
    std::string any = bytes;
    for (int k = 0; k < 3; ++k) any[random() % any.size()] = static_cast<char>(random());
    const auto row = RowBytes::of(any);
    if (!row) continue;
    const std::string again = encode_row(row->row(0));
    EXPECT_LE(again.size(), any.size());
    const auto back = RowBytes::of(again);
    ASSERT_TRUE(back);
    EXPECT_TRUE(same_bits(back->row(0), row->row(0)));
  }
}

}  // namespace
}  // namespace resonid::monitor::test
