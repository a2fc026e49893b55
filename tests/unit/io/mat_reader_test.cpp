// SPDX-License-Identifier: MIT
#include <matio.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <resonid/base/error_text.hpp>
#include <resonid/io/detail/table.hpp>
#include <resonid/io/record_reader.hpp>

#include "temporary_folder.hpp"

namespace resonid::io {
namespace {

using test::TemporaryFolder;
using Column = std::vector<double>;
using Names = std::vector<std::string>;

/// Writes variables into a new MAT file with matio.
class MatWriter {
 public:
  MatWriter(const std::filesystem::path& path, mat_ft version)
      : file_(Mat_CreateVer(path.c_str(), nullptr, version)) {}
  MatWriter(const MatWriter&) = delete;
  MatWriter& operator=(const MatWriter&) = delete;
  ~MatWriter() { Mat_Close(file_); }

  template <class Number>
  void array(const char* name, matio_classes kind, matio_types type, std::vector<Number> data,
             std::size_t rows, std::size_t columns) {
    std::array<std::size_t, 2> dims{rows, columns};
    write(Mat_VarCreate(name, kind, type, 2, dims.data(), data.data(), 0));
  }
  void doubles(const char* name, const Column& data, bool row = false) {
    array(name, MAT_C_DOUBLE, MAT_T_DOUBLE, data, row ? 1 : data.size(), row ? data.size() : 1);
  }
  void complex(const char* name, Column re, Column im) {
    std::array<std::size_t, 2> dims{re.size(), 1};
    mat_complex_split_t split{re.data(), im.data()};
    write(Mat_VarCreate(name, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims.data(), &split, MAT_F_COMPLEX));
  }
  void structure(const char* name) {
    std::array<std::size_t, 2> dims{1, 1};
    const char* field = "u";
    matvar_t* variable = Mat_VarCreateStruct(name, 2, dims.data(), &field, 1);
    std::array<std::size_t, 2> size{2, 1};
    Column data{1, 2};
    Mat_VarSetStructFieldByName(
        variable, field, 0, Mat_VarCreate(field, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, size.data(), data.data(), 0));
    write(variable);
  }
  void cell(const char* name) {
    std::array<std::size_t, 2> dims{1, 1};
    matvar_t* variable = Mat_VarCreate(name, MAT_C_CELL, MAT_T_CELL, 2, dims.data(), nullptr, 0);
    std::array<std::size_t, 2> size{2, 1};
    Column data{1, 2};
    Mat_VarSetCell(variable, 0,
                   Mat_VarCreate(nullptr, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, size.data(), data.data(), 0));
    write(variable);
  }

 private:
  void write(matvar_t* variable) {
    ASSERT_NE(variable, nullptr);
    EXPECT_EQ(Mat_VarWrite(file_, variable, MAT_COMPRESSION_NONE), 0);
    Mat_VarFree(variable);
  }

  mat_t* file_;
};

class MatReader : public ::testing::TestWithParam<mat_ft> {
 protected:
  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "record.mat";
};

TEST_P(MatReader, ReadsVectorsOfAllNumericClassesAndKeepsScalarsApart) {
  {
    MatWriter file(path_, GetParam());
    file.doubles("a", {1.5, -2.25, 1e300});
    file.doubles("b", {4, 5, 6}, true);
    file.array<float>("c", MAT_C_SINGLE, MAT_T_SINGLE, {0.5F, -0.25F, 3.0F}, 3, 1);
    file.array<std::int16_t>("d", MAT_C_INT16, MAT_T_INT16, {-3, 0, 32767}, 1, 3);
    file.array<std::uint8_t>("e", MAT_C_UINT8, MAT_T_UINT8, {0, 1, 255}, 3, 1);
    file.array<std::int64_t>("f", MAT_C_INT64, MAT_T_INT64, {-1, 0, 1LL << 40}, 3, 1);
    file.doubles("fs", {2500});
  }
  const auto table = read_table(path_);
  ASSERT_TRUE(table) << message_of(table.error());
  EXPECT_EQ(table->names, (Names{"a", "b", "c", "d", "e", "f"}));
  EXPECT_EQ(table->columns[0], (Column{1.5, -2.25, 1e300}));
  EXPECT_EQ(table->columns[1], (Column{4, 5, 6}));
  EXPECT_EQ(table->columns[2], (Column{0.5, -0.25, 3}));
  EXPECT_EQ(table->columns[3], (Column{-3, 0, 32767}));
  EXPECT_EQ(table->columns[4], (Column{0, 1, 255}));
  EXPECT_EQ(table->columns[5], (Column{-1, 0, 1099511627776.0}));
  ASSERT_EQ(table->scalars.size(), 1U);
  EXPECT_EQ(table->scalars[0].name, "fs");
  EXPECT_EQ(table->scalars[0].value, 2500.0);
  EXPECT_EQ(table->place(1), "element 2");
}

TEST_P(MatReader, RefusesOtherVariablesOnlyWhenTheyAreAskedFor) {
  Column rising(32);
  for (std::size_t i = 0; i < rising.size(); ++i) rising[i] = 0.01 * static_cast<double>(i);
  Column holed = rising;
  holed[4] = std::numeric_limits<double>::quiet_NaN();
  {
    MatWriter file(path_, GetParam());
    file.doubles("t", rising);
    file.doubles("u", rising);
    file.doubles("y", rising);
    file.doubles("short", {1, 2, 3});
    file.doubles("fs", {10});
    file.complex("spectrum", {1, 2}, {3, 4});
    file.array<double>("matrix", MAT_C_DOUBLE, MAT_T_DOUBLE, {1, 2, 3, 4, 5, 6}, 3, 2);
    file.structure("log");
    file.cell("box");
    file.doubles("holed", holed);
  }
  const auto with_input = [&](const char* name) {
    ColumnMapping mapping;
    mapping.input = name;
    return read_record(path_, mapping);
  };
  const auto plain = with_input("u");
  ASSERT_TRUE(plain) << message_of(plain.error());
  EXPECT_EQ(plain->input.samples, rising);
  EXPECT_EQ(plain->sample_rate_hz, 100.0);
  RESONID_EXPECT_MESSAGE(with_input("spectrum"), "record.mat: variable 'spectrum' (.input) is complex (2x1)");
  RESONID_EXPECT_MESSAGE(with_input("matrix"),
                         "'matrix' (.input) is a matrix (3x2); name one of its columns, matrix_1 ...");
  RESONID_EXPECT_MESSAGE(with_input("matrix_1"), "'y' has 32 samples and 'matrix_1' has 3");
  RESONID_EXPECT_MESSAGE(with_input("log"),
                         "variable 'log' (.input) is a struct (1x1); name one of its fields");
  RESONID_EXPECT_MESSAGE(with_input("log.u"), "'y' has 32 samples and 'log.u' has 2");
  RESONID_EXPECT_MESSAGE(with_input("box"), "variable 'box' (.input) is a cell array (1x1)");
  EXPECT_EQ(with_input("holed")->sampling.gaps, 1U);  // 3 %: more than is filled
  RESONID_EXPECT_MESSAGE(with_input("fs"), "variable 'fs' (.input) is a single number");
  RESONID_EXPECT_MESSAGE(with_input("short"),
                         "'y' has 32 samples and 'short' has 3; all signals must have equally many");
  RESONID_EXPECT_MESSAGE(with_input("v"), "there is no column 'v' (.input)");
}

TEST_P(MatReader, NamesAVariableThatWouldHaveBeenFound) {
  {
    MatWriter file(path_, GetParam());
    file.doubles("y", Column(32, 1.0));
    file.doubles("fs", {100});
    file.array<double>("u", MAT_C_DOUBLE, MAT_T_DOUBLE, {1, 2, 3, 4}, 2, 2);
  }
  ColumnMapping mapping;
  mapping.sample_rate_hz = 100;
  RESONID_EXPECT_MESSAGE(read_record(path_, mapping),
                         "variable 'u', which may be the input, is a matrix (2x2)");
  mapping = {};
  mapping.input = "y";
  mapping.output = "y";
  RESONID_EXPECT_MESSAGE(read_record(path_, mapping), ".input and .output are the same column 'y'");
}

TEST_P(MatReader, TakesTheSampleRateFromAScalar) {
  {
    MatWriter file(path_, GetParam());
    file.doubles("u", Column(32, 1.0));
    file.doubles("y", Column(32, 1.0));
    file.doubles("fs", {2500});
  }
  EXPECT_EQ(read_record(path_, {})->sample_rate_hz, 2500.0);
}

TEST_P(MatReader, PointsOutScalarsWhenTheSampleRateIsNotKnown) {
  {
    MatWriter file(path_, GetParam());
    file.doubles("u", Column(32, 1.0));
    file.doubles("y", Column(32, 1.0));
    file.doubles("tick", {2500});
  }
  RESONID_EXPECT_MESSAGE(read_record(path_, {}), ".sample_rate_hz; the file holds tick = 2500");
}

TEST_P(MatReader, RefusesAFileWithoutAVector) {
  {
    MatWriter file(path_, GetParam());
    file.cell("log");
    file.doubles("fs", {2500});
  }
  RESONID_EXPECT_MESSAGE(read_mat(path_), "no variable is a vector of numbers: 'log' is a cell array (1x1)");
}

TEST(MatReader, ReportsATruncatedFileWithoutPrintingAnything) {
  const TemporaryFolder folder;
  {
    MatWriter file(folder / "whole.mat", MAT_FT_MAT73);
    file.doubles("u", Column(2000, 1.0));
  }
  const auto path = folder.file("cut.mat", test::contents_of(folder / "whole.mat").substr(0, 1500));
  ::testing::internal::CaptureStderr();
  const auto table = read_table(path);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  RESONID_EXPECT_MESSAGE(table, "cut.mat: holds no variable that can be read: it is empty or damaged");
}

TEST(MatReader, RefusesAFileThatEndsInTheMiddleOfAVariable) {
  const TemporaryFolder folder;
  {
    MatWriter file(folder / "whole.mat", MAT_FT_MAT5);
    file.doubles("t", Column(200, 1.0));
    file.doubles("u", Column(200, 1.0));
  }
  const std::string whole = test::contents_of(folder / "whole.mat");
  EXPECT_TRUE(read_mat(folder / "whole.mat"));
  for (const std::size_t size : {whole.size() - 1, whole.size() - 900, whole.size() - 1700})
    RESONID_EXPECT_MESSAGE(read_mat(folder.file("cut.mat", whole.substr(0, size))),
                           "ends in the middle of a variable");
}

INSTANTIATE_TEST_SUITE_P(Versions, MatReader, ::testing::Values(MAT_FT_MAT5, MAT_FT_MAT73),
                         [](const auto& version) { return version.param == MAT_FT_MAT5 ? "v5" : "v7_3"; });

/// Found by fuzz/mat.cpp: version 4, whose header says 0x3b000018 rows of doubles, 8 GB, in a file of 38
/// bytes.
TEST(MatReader, RefusesAVariableThatIsLargerThanTheFileCanHold) {
  const TemporaryFolder folder;
  const std::string header("\0\0\0\0\x18\0\0\x3b\1\0\0\0\0\0\0\0\2\0\0\0t\0", 22);
  RESONID_EXPECT_MESSAGE(read_mat(folder.file("claims.mat", header + std::string(16, '\1'))),
                         "claims.mat: variable 't' cannot be read: the file is damaged");
}

TEST(MatReader, RefusesWhatIsNoMatFile) {
  const TemporaryFolder folder;
  RESONID_EXPECT_MESSAGE(read_mat(folder / "absent.mat"), "absent.mat: there is no such file");
  RESONID_EXPECT_MESSAGE(read_table(folder.file("empty.mat", "")), "empty.mat: the file is empty");
  RESONID_EXPECT_MESSAGE(read_table(folder.file("text.mat", "t,u\n0,1\n2,3\n")),
                         "text.mat: is not a MAT file of version 4, 5 or 7.3");
  RESONID_EXPECT_MESSAGE(read_table(folder.file("other.h5", "\x89HDF\r\n\x1a\n rest")), "is not a MAT file");
}

/// scipy as a second opinion on what a MAT 5 file is; compressed, as most are.
TEST(MatReader, ReadsWhatScipyWrites) {
  if (std::system("/usr/bin/python3 -c 'import scipy.io' > /dev/null 2>&1") != 0)
    GTEST_SKIP() << "/usr/bin/python3 with scipy is not here";
  const TemporaryFolder folder;
  const auto path = folder / "scipy.mat";
  const std::string command =
      "/usr/bin/python3 -c \"import numpy as np, scipy.io; k = np.arange(40.0); scipy.io.savemat('" +
      path.string() +
      "', {'time_s': k / 8, 'u_A': np.sin(k), 'y_rad_s': np.arange(40, dtype=np.int16) - 20, 'note': 'x', "
      "'Ts': 0.125},"
      " do_compression=True, oned_as='column')\" > /dev/null 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const auto record = read_record(path, {});
  ASSERT_TRUE(record) << message_of(record.error());
  EXPECT_EQ(record->sample_rate_hz, 8.0);
  EXPECT_EQ(record->input.unit, "A");
  EXPECT_EQ(record->output.unit, "rad/s");
  ASSERT_EQ(record->samples(), 40U);
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_NEAR(record->input.samples[i], std::sin(static_cast<double>(i)), 1e-15);
    EXPECT_EQ(record->output.samples[i], static_cast<double>(i) - 20.0);
  }
}

}  // namespace
}  // namespace resonid::io
