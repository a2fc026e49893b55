// SPDX-License-Identifier: MIT
// Writes the columns of a table as variables of a MAT file of version 7.3, compressed: what takes all of
// matio, HDF5 and zlib to read. csv_to_mat73 RECORD.csv RECORD.mat
#include <matio.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { kColumns = 32, kRows = 100000 };
static double values[kColumns][kRows];

int main(int argc, char** argv) {
  char line[4096];
  char* names[kColumns];
  int columns = 0;
  size_t rows = 0;
  FILE* csv = argc == 3 ? fopen(argv[1], "r") : NULL;
  if (csv == NULL || fgets(line, sizeof line, csv) == NULL) return 1;
  for (char* name = strtok(line, ",\n"); name != NULL && columns < kColumns; name = strtok(NULL, ",\n"))
    names[columns++] = strdup(name);
  for (char row[4096]; rows < kRows && fgets(row, sizeof row, csv) != NULL; ++rows) {
    char* at = row;
    for (int k = 0; k < columns; ++k) {
      values[k][rows] = strtod(at, &at);
      if (*at == ',') ++at;
    }
  }
  fclose(csv);
  mat_t* mat = Mat_CreateVer(argv[2], NULL, MAT_FT_MAT73);
  if (mat == NULL) return 1;
  for (int k = 0; k < columns; ++k) {
    size_t size[2] = {rows, 1};
    matvar_t* variable =
        Mat_VarCreate(names[k], MAT_C_DOUBLE, MAT_T_DOUBLE, 2, size, values[k], MAT_F_DONT_COPY_DATA);
    if (variable == NULL || Mat_VarWrite(mat, variable, MAT_COMPRESSION_ZLIB) != 0) return 1;
    Mat_VarFree(variable);
  }
  Mat_Close(mat);
  printf("%d variables of %zu values\n", columns, rows);
  return 0;
}
