/* A C program that uses an installed btfc through a read callback: prints what a file holds and its top left
 * texel. */
#include <btfc/btfc.h>
#include <stdio.h>
#include <stdlib.h>

static int read_file(void* user, uint64_t offset, void* destination, size_t size) {
  FILE* file = user;
  return fseek(file, (long)offset, SEEK_SET) != 0 || fread(destination, 1, size, file) != size;
}

int main(int argc, char** argv) {
  FILE* file = argc == 2 ? fopen(argv[1], "rb") : NULL;
  if (file == NULL || fseek(file, 0, SEEK_END) != 0) {
    fprintf(stderr, "usage: consumer FILE.btfc\n");
    return 1;
  }

  btfc_source source = {0};
  source.read = read_file;
  source.user = file;
  source.size = (uint64_t)ftell(file);
  btfc_reader* reader = NULL;
  btfc_texture* texture = NULL;
  btfc_error error;
  if (btfc_reader_open(&source, NULL, &reader, &error) != BTFC_OK ||
      btfc_texture_load(reader, NULL, &texture, &error) != BTFC_OK) {
    fprintf(stderr, "consumer: %s\n", error.message);
    btfc_reader_free(reader);
    fclose(file);
    return 1;
  }
  btfc_reader_free(reader);
  fclose(file);

  const uint32_t width = btfc_texture_width(texture), height = btfc_texture_height(texture);
  btfc_map_info map;
  btfc_result result = btfc_texture_map_info(texture, 0, &map);
  const size_t row = (size_t)width * map.channels, size = row * height;
  unsigned char* rows = malloc(size);
  if (result == BTFC_OK && rows != NULL)
    result = btfc_decode_rect(texture, NULL, 0, NULL, 0, 0, width, height, BTFC_UNORM8, rows, row, size);
  if (result == BTFC_OK && rows != NULL) {
    unsigned sum = 0;
    for (size_t i = 0; i < size; ++i) sum = sum * 31u + rows[i];
    printf("btfc %s: %ux%u, map %s, first code %u, sum %u\n", btfc_version(), (unsigned)width,
           (unsigned)height, map.name, rows[0], sum);
  }
  const int good = result == BTFC_OK && rows != NULL;
  free(rows);
  btfc_texture_free(texture);
  return good ? 0 : 1;
}
