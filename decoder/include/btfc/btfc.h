/* btfc.h - the decoder's C interface. This header is its manual.
 *
 * Objects
 *   reader   the header and index of a file, over memory or a positioned-read callback; chunks are read on
 * demand. Use one from one thread at a time. Opening costs two reads. texture  an immutable decoded item. Any
 * number of threads may evaluate it at once. It does not need its reader. scratch  a thread's caches, for
 * models that have some; NULL is always allowed and never changes a result.
 *
 * Coordinates
 *   Texel (0, 0) is the top left one; x goes right, y down; the centre of a texel lies at +0.5. Directions
 * point away from the surface in a right-handed frame: x to image right, y to image top, z along the normal.
 *
 * Errors
 *   Data errors (a damaged file, a limit, memory) are results, and the functions that meet files fill a
 * btfc_error. Caller errors (a NULL that is not allowed, a map number out of range, a buffer too small)
 * return BTFC_BAD_ARGUMENT, change nothing, and stop the program in debug builds (assert). That is the whole
 * border. Nothing here throws, logs, allocates globally or keeps global state. The library never reads the
 * environment.
 *
 * Lifetimes
 *   Pointers returned inside structs live as long as the object they came from. Every *_free accepts NULL.
 *
 * The format is described in spec/; rule numbers in messages ("D8") refer to it. */
#ifndef BTFC_BTFC_H
#define BTFC_BTFC_H
#include <stddef.h>
#include <stdint.h>

#ifdef __GNUC__
#define BTFC_API __attribute__((visibility("default")))
#else
#define BTFC_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define BTFC_VERSION_MAJOR 0
#define BTFC_VERSION_MINOR 1
#define BTFC_VERSION_PATCH 0

typedef enum btfc_result {
  BTFC_OK = 0,
  BTFC_BAD_ARGUMENT = 1,
  BTFC_IO = 2,           /* the source's read failed */
  BTFC_INVALID_FILE = 3, /* a rule of the spec is broken */
  BTFC_OUT_OF_MEMORY = 4,
  BTFC_LIMIT = 5,      /* above a limit of btfc_options */
  BTFC_UNSUPPORTED = 6 /* needs a newer or fuller reader: version, feature, model or critical chunk */
} btfc_result;

/* Where bytes come from. read fills destination with size bytes from offset and returns 0, or another value
 * where it cannot. It may be called from the thread that calls the reader, only. user is passed through. */
typedef struct btfc_source {
  int (*read)(void* user, uint64_t offset, void* destination, size_t size);
  void* user;
  uint64_t size; /* of the whole file, bytes */
} btfc_source;

/* Zero means default. Set struct_size to sizeof(btfc_options): later versions append fields. */
typedef struct btfc_options {
  size_t struct_size;
  uint64_t max_payload_bytes; /* refuse files with more payload; default 4 GiB */
  uint32_t max_chunks;        /* default 2^20, the format's cap */
} btfc_options;

/* What went wrong: one sentence (what, where, what was expected), the rule, and a byte offset in the file. */
typedef struct btfc_error {
  btfc_result result;
  char rule[8]; /* "D8", or empty */
  uint64_t offset;
  char message[256];
} btfc_error;

typedef struct btfc_reader btfc_reader;
typedef struct btfc_texture btfc_texture;
typedef struct btfc_scratch btfc_scratch;

/* A short name of a result, never NULL. */
BTFC_API const char* btfc_result_name(btfc_result result);

/* "0.1.0" */
BTFC_API const char* btfc_version(void);

/* ---- reader
 * ---------------------------------------------------------------------------------------------------- */

/* Reads the directory, HEAD and PARM, and checks every rule up to D12: two reads of the directory, two small
 * ones. options and error may be NULL. The source is copied; what user points to must outlive the reader. */
BTFC_API btfc_result btfc_reader_open(const btfc_source* source, const btfc_options* options,
                                      btfc_reader** reader_ret, btfc_error* error);

/* The same over memory, which must outlive the reader. */
BTFC_API btfc_result btfc_reader_open_memory(const void* data, size_t data_size, const btfc_options* options,
                                             btfc_reader** reader_ret, btfc_error* error);

BTFC_API void btfc_reader_free(btfc_reader* reader);

typedef struct btfc_file_info {
  const char* model; /* "patch" */
  uint32_t version_major, version_minor;
  uint32_t width, height; /* texels */
  uint32_t channels, maps;
  uint32_t views, lights, pairs;
  int unbounded;
  uint32_t chunks;
  uint64_t file_bytes;
  uint64_t payload_bits; /* = the model's formula */
  uint64_t memory_bits;  /* of words and planes, as a GPU holds them; on the CPU a map of three channels
                            keeps its sample a second time without padding, 3/4 of its plane */
  uint32_t levels;       /* that btfc_selection.levels may count; 1 of models without */
  uint32_t gates;        /* the most that btfc_selection.gates may be; 0: the model has none */
  int culls;             /* whether btfc_selection.culling changes anything */
} btfc_file_info;

BTFC_API btfc_result btfc_reader_info(const btfc_reader* reader, btfc_file_info* info_ret);

typedef struct btfc_chunk_info {
  char type[5];
  uint16_t flags; /* bit 0 critical, 1 payload, 2 safe-to-copy */
  uint16_t codec; /* 0 raw, 1 zstd */
  uint8_t level, part;
  uint32_t tile;
  uint64_t offset, stored_bytes, raw_bytes, raw_hash;
} btfc_chunk_info;

/* index: 0 … chunks-1, in file order. */
BTFC_API btfc_result btfc_reader_chunk_info(const btfc_reader* reader, uint32_t index,
                                            btfc_chunk_info* info_ret);

/* Reads, undoes and checks one chunk: one read of the source. raw_size must be its raw_bytes. */
BTFC_API btfc_result btfc_reader_read_chunk(btfc_reader* reader, uint32_t index, void* raw, size_t raw_size,
                                            btfc_error* error);

/* Every numbered rule of the spec over the whole file, and formula == payload. */
BTFC_API btfc_result btfc_verify(const btfc_source* source, const btfc_options* options, btfc_error* error);

/* ---- texture
 * --------------------------------------------------------------------------------------------------- */

/* Which part of an item to load, and how closely it is followed. Zero means default. Set struct_size to
 * sizeof(btfc_selection): later versions append fields, and a shorter struct of an earlier one is taken. */
typedef struct btfc_selection {
  size_t struct_size;
  uint32_t levels; /* how many levels, the coarsest counted: 1 is that alone, 1 + k adds k components of pca;
                      default all. Chunks of finer levels are not read. Models without levels ignore it. */
  uint32_t period; /* of unbounded textures: repeat without seams every so many texels both ways; 0: never. A
                      multiple of 2^(levels - 1), of gmrf's torus, and of the tile where there is a relief; at
                      most 2^30 */
  uint32_t relief; /* of unbounded textures with a range map: BTFC_RELIEF_ flags */
  uint32_t gates;  /* of gm: only so many of the highest gates of a texel count, in shaders too; at most
                      btfc_file_info.gates; default as the file has it */
  float culling;   /* of gm on the CPU: rectangles and batches may leave out components that together weigh so
                      little, 1e-7 to 0.1, which moves a value by at most that share of the outputs' range;
                      default 1e-5. Shaders leave nothing out */
} btfc_selection;

#define BTFC_RELIEF_NONE 1u     /* no bump filter */
#define BTFC_RELIEF_SHADOW 2u   /* cast shadows */
#define BTFC_RELIEF_PARALLAX 4u /* texels shifted by their height along the view */

/* Loads item 0, all tiles. selection may be NULL: everything. On success *texture_ret is to be freed with
 * btfc_texture_free. */
BTFC_API btfc_result btfc_texture_load(btfc_reader* reader, const btfc_selection* selection,
                                       btfc_texture** texture_ret, btfc_error* error);

BTFC_API void btfc_texture_free(btfc_texture* texture);

/* What a file's maker measured it to be worth under settings of a btfc_selection: the QUAL chunk. */
#define BTFC_QUALITY_PSNR 1u     /* psnr_db: of models that keep texels in place */
#define BTFC_QUALITY_LAB 2u      /* mae_lab */
#define BTFC_QUALITY_DISTANCE 4u /* distance: of models that do not keep texels in place */
#define BTFC_QUALITY_RATE 8u     /* rate */
#define BTFC_QUALITY_COST 16u    /* operations, reads */

typedef struct btfc_quality_info {
  uint32_t measures; /* BTFC_QUALITY_ flags: what points have; the rest of a point is 0 */
  uint32_t pairs;    /* of directions that were measured, evenly among the file's */
  uint32_t points;   /* 0: the file has no curve */
} btfc_quality_info;

typedef struct btfc_quality_point {
  uint32_t levels, gates; /* as in btfc_selection, */
  float culling;          /* 0 where they are the file's own */
  float psnr_db;          /* 200: no difference */
  float mae_lab;          /* mean absolute difference in CIE Lab */
  float distance;         /* spec/btfc.md section 5.5; 0: no difference */
  float rate; /* texels decoded by whole images on one core, over random fetches of uncompressed ones */
  uint32_t operations, reads; /* of a texel in a shader; reads are words of 32 bits */
} btfc_quality_point;

/* The first point_count of the curve's points; points may be NULL with point_count 0. One read of the source.
 * A file without a curve is no error: info_ret->points is 0. */
BTFC_API btfc_result btfc_reader_quality(btfc_reader* reader, btfc_quality_info* info_ret,
                                         btfc_quality_point* points, size_t point_count, btfc_error* error);

/* What is wanted of a file; zero: no matter. */
typedef struct btfc_wanted {
  size_t struct_size;
  float psnr_db;       /* at least */
  float distance;      /* at most */
  uint32_t operations; /* of a texel in a shader, at most */
} btfc_wanted;

/* Sets levels, gates and culling of a selection, and nothing else of it, to the point of the file's curve
 * that gives all that is wanted: where an error is wanted the one of the fewest operations, else the one of
 * the least error; ties go to the higher rate. A function of the curve alone. BTFC_BAD_ARGUMENT where the
 * file has no curve, or no such point: the message names the nearest. point_ret may be NULL. */
BTFC_API btfc_result btfc_choose(btfc_reader* reader, const btfc_wanted* wanted, btfc_selection* selection,
                                 btfc_quality_point* point_ret, btfc_error* error);

typedef enum btfc_sample {
  BTFC_UNORM8 = 0,
  BTFC_UNORM16 = 1,
  BTFC_FLOAT16 = 2,
  BTFC_FLOAT32 = 3
} btfc_sample;

typedef struct btfc_map_info {
  const char* name;
  uint32_t channels;        /* 1 to 4 */
  btfc_sample sample;       /* of the original; patch stores codes of this type, and asking for it gives them
                               unchanged; the values of other models are rounded to it */
  const char* colour_space; /* spec/registry.md */
  int alpha;                /* 0 none, 1 straight, 2 premultiplied; the last channel */
} btfc_map_info;

BTFC_API uint32_t btfc_texture_width(const btfc_texture* texture);
BTFC_API uint32_t btfc_texture_height(const btfc_texture* texture);
/* 1 where every texel of the plane is another one, whatever the width and height of what was analysed. */
BTFC_API int btfc_texture_unbounded(const btfc_texture* texture);
BTFC_API uint32_t btfc_texture_maps(const btfc_texture* texture);
BTFC_API btfc_result btfc_texture_map_info(const btfc_texture* texture, uint32_t map,
                                           btfc_map_info* info_ret);

/* The directions of a BTF: how many, and which pairs were measured (pair 0 … pairs-1, by view, then light).
 * Textures without directions have 1 view, 1 light and 1 pair, all along the normal. */
BTFC_API uint32_t btfc_texture_views(const btfc_texture* texture);
BTFC_API uint32_t btfc_texture_lights(const btfc_texture* texture);
BTFC_API uint32_t btfc_texture_pairs(const btfc_texture* texture);
/* Unit vectors, within 1e-7 of what the encoder was given. */
BTFC_API btfc_result btfc_texture_view(const btfc_texture* texture, uint32_t view, float direction[3]);
BTFC_API btfc_result btfc_texture_light(const btfc_texture* texture, uint32_t light, float direction[3]);
BTFC_API btfc_result btfc_texture_pair(const btfc_texture* texture, uint32_t pair, uint32_t* view_ret,
                                       uint32_t* light_ret);

/* ---- domain
 *
 * A file may be made for some views, lights and footprints only (chunk DOMN). Outside of them it still
 * answers: of directions, with the nearest one that its views or lights span, nearest in the projection of
 * spec/tables.md section 4; of footprints, as for any. btfc_covers says whether an answer is one that the
 * file was made for.
 * --------------------------------------------------------------------------------------------------- */

#define BTFC_COVERS_VIEW 1u
#define BTFC_COVERS_LIGHT 2u
#define BTFC_COVERS_FOOTPRINT 4u
#define BTFC_COVERS_ALL 7u

/* Which parts of a query lie inside the domain, as BTFC_COVERS_ flags. Directions are taken as in btfc_query.
 * A view is covered where it lies within the domain's tolerance of a direction that the file's views span
 * (the corners of a triangle of measured ones, or the border between two) and within the tolerance of one
 * that the domain allows; a light likewise. Where the domain lists pairs a light is covered where it and the
 * view, both together, lie within radius + tolerance of a pair. A footprint is covered within footprint_least
 * and footprint_most. A file without DOMN allows all that its directions span, with a tolerance of 2 degrees,
 * and every footprint; textures without directions cover all of them. */
BTFC_API uint32_t btfc_covers(const btfc_texture* texture, const float view[3], const float light[3],
                              float footprint);

typedef enum btfc_domain_kind {
  BTFC_DOMAIN_ALL = 0,   /* what the file's directions span */
  BTFC_DOMAIN_RANGE = 1, /* elevations and azimuths */
  BTFC_DOMAIN_LIST = 2,  /* listed directions, btfc_domain_view and btfc_domain_light */
  BTFC_DOMAIN_PAIRS = 3  /* listed pairs: view i with light i */
} btfc_domain_kind;

/* Radians. Azimuths from phi_from on, phi_width further; at the normal every azimuth is meant. */
typedef struct btfc_direction_range {
  float theta_least, theta_most, phi_from, phi_width;
} btfc_direction_range;

typedef struct btfc_domain {
  int stated; /* 0: the file has no DOMN, and the rest is what then holds */
  btfc_domain_kind views, lights;
  btfc_direction_range view_range, light_range; /* of kind range, otherwise zeros */
  uint32_t view_count, light_count;             /* of kinds list and pairs, otherwise 0 */
  float tolerance;                              /* radians */
  float radius;                                 /* radians about a listed direction that it stands for */
  uint32_t origin_x, origin_y;                  /* texel (0, 0) in the original, in texels of the original */
  uint32_t scale;                        /* so many texels of the original a side are one of the file */
  float footprint_least, footprint_most; /* texels of the file */
} btfc_domain;

BTFC_API btfc_result btfc_texture_domain(const btfc_texture* texture, btfc_domain* domain_ret);
/* Unit vectors of listed directions, index below view_count or light_count. */
BTFC_API btfc_result btfc_domain_view(const btfc_texture* texture, uint32_t index, float direction[3]);
BTFC_API btfc_result btfc_domain_light(const btfc_texture* texture, uint32_t index, float direction[3]);

/* NULL where there is not enough memory. One scratch serves one thread and one texture. Unbounded textures
 * keep tiles of 256x256 finished texels in it, up to 224 MiB; without one a call makes its own, and a few
 * queries are answered by sums over impulse responses, exact within the file's error but a thousand times
 * slower. Other textures keep nothing. */
BTFC_API btfc_scratch* btfc_scratch_new(const btfc_texture* texture);
BTFC_API void btfc_scratch_free(btfc_scratch* scratch);

typedef struct btfc_query {
  int32_t x, y; /* texel; outside the texture the file's wrap rule applies */
  uint32_t map;
  uint32_t level;          /* 0: full resolution; models without levels ignore it */
  float view[3], light[3]; /* any length; below the surface: the horizon; all 0: the normal. Outside the
                              measured directions the nearest ones between them count. Models without
                              directions ignore both */
  float footprint;         /* texels */
} btfc_query;

/* What all texels of a call are seen under. */
typedef struct btfc_directions {
  float view[3], light[3]; /* as in btfc_query */
  float footprint;
  uint32_t level;
} btfc_directions;

/* Point samples as float32: channels(map) values a query at values + q * value_stride (in floats, >=
 * channels). query_stride is in bytes. Deterministic, and equal to the same texel of btfc_decode_rect; of
 * model gm equal within 1e-4 of the range of its values, since both leave out what hardly counts among the
 * queries of a call. A few hundred queries of a call are answered faster than one by one. */
BTFC_API btfc_result btfc_eval(const btfc_texture* texture, btfc_scratch* scratch, const btfc_query* queries,
                               size_t query_stride, size_t query_count, float* values, size_t value_stride);

/* A batch of texels of one map in any sample type, all under the same directions (NULL: both along the
 * normal). texels holds count pairs (x, y); output element q begins at out + q * channels samples. out_size:
 * bytes of out, at least count * channels * size of a sample. */
BTFC_API btfc_result btfc_decode_texels(const btfc_texture* texture, btfc_scratch* scratch, uint32_t map,
                                        const btfc_directions* directions, const int32_t* texels,
                                        size_t count, btfc_sample sample, void* out, size_t out_size);

/* A rectangle of one map in any sample type under one pair of directions (NULL: both along the normal), rows
 * from the top, channels interleaved. It may reach outside the texture. row_stride is in bytes, at least
 * width * channels * size of a sample; out_size covers height rows. */
BTFC_API btfc_result btfc_decode_rect(const btfc_texture* texture, btfc_scratch* scratch, uint32_t map,
                                      const btfc_directions* directions, int32_t x, int32_t y, uint32_t width,
                                      uint32_t height, btfc_sample sample, void* out, size_t row_stride,
                                      size_t out_size);

/* ---- for a GPU
 *
 * btfc owns no device, queue or allocation. An engine makes four storage buffers of the plan's sizes, uploads
 * the words, runs the plan's passes where there are some, and then reads texels in any shader that includes
 * shaders/btfc.glsl, or by the embedded entry points. spec/shaders.md is the page for engine programmers.
 * --------------------------------------------------------------- */

/* Parameters of a map: 4-byte scalars, laid out as <Model>Params of shaders/models/<model>.h (car, gmrf,
 * car3d: FieldParams of field.h). */
BTFC_API size_t btfc_gpu_params_size(const btfc_texture* texture, uint32_t map);
BTFC_API btfc_result btfc_gpu_write_params(const btfc_texture* texture, uint32_t map, void* params,
                                           size_t params_size);

/* Word arrays 0 … 3, each at most 2^27 bytes; 0 bytes where the model leaves a slot empty. */
#define BTFC_WORD_SLOTS 4
BTFC_API size_t btfc_gpu_words_size(const btfc_texture* texture, uint32_t slot);
BTFC_API btfc_result btfc_gpu_write_words(const btfc_texture* texture, uint32_t slot, void* words,
                                          size_t words_size);

/* Planes inside the word arrays, for engines that bind images instead. */
typedef struct btfc_plane_info {
  uint32_t width, height, channels; /* texels */
  uint32_t texel_bits;              /* 8, 16, 32 or 64: channels padded to 1, 2 or 4 */
  btfc_sample sample;
  uint32_t slot, first_word; /* where it lies; texels in rows, the first in the lowest bits */
} btfc_plane_info;

BTFC_API uint32_t btfc_gpu_planes(const btfc_texture* texture);
BTFC_API btfc_result btfc_gpu_plane_info(const btfc_texture* texture, uint32_t plane,
                                         btfc_plane_info* info_ret);

/* Which texels of an unbounded texture are to be prepared: inside, a shader reads them from memory, outside,
 * it computes each on its own, some thousand times slower. Of a texture with a period: any window stands for
 * the whole period. Textures that are not unbounded ignore it. */
typedef struct btfc_gpu_window {
  int32_t x, y;           /* of level 0 */
  uint32_t width, height; /* both 0: nothing is prepared */
} btfc_gpu_window;

/* A compute dispatch. Bindings, set 0: 0 and 1 word arrays 0 and 1, 2 word array 2 (written), 3 the scratch
 * buffer (written), 4 a uniform buffer with the parameters of map 0. */
typedef struct btfc_gpu_pass {
  const char* shader; /* of btfc_gpu_shader; entry point "main" */
  uint32_t groups[3];
  uint32_t push[16]; /* push constants, the first push_size bytes of them */
  uint32_t push_size;
} btfc_gpu_pass;

/* Parameters of a map as a uniform buffer holds them, padded; word i may also be specialisation constant
 * 16 + i of a pipeline that is made for one file. */
typedef struct btfc_gpu_params {
  uint32_t words[32];
} btfc_gpu_params;

typedef struct btfc_gpu_plan_info {
  uint32_t model;                         /* specialisation constant 0 */
  uint64_t words_size[BTFC_WORD_SLOTS];   /* of the storage buffers, bytes; at least 4, at most 2^27 */
  uint64_t words_upload[BTFC_WORD_SLOTS]; /* of these, what btfc_gpu_write_words gives; the rest is made by
                                             the passes */
  uint64_t scratch_size;                  /* of a buffer that the passes alone need; 0: none */
  const btfc_gpu_pass* passes;            /* in this order, a memory barrier between all of them and behind */
  uint32_t pass_count;
  const btfc_gpu_params* params; /* of each map */
  uint32_t map_count;
  uint32_t fixed_params; /* so many of their words, the first, are the same whatever the window */
} btfc_gpu_plan_info;

typedef struct btfc_gpu_plan btfc_gpu_plan;

/* Sizes, uploads, passes and bindings for a texture. window may be NULL: nothing is prepared. BTFC_LIMIT
 * where the prepared window would not fit into a buffer of 2^27 bytes. */
BTFC_API btfc_result btfc_gpu_plan_new(const btfc_texture* texture, const btfc_gpu_window* window,
                                       btfc_gpu_plan** plan_ret, btfc_error* error);
BTFC_API const btfc_gpu_plan_info* btfc_gpu_plan_get(const btfc_gpu_plan* plan);
BTFC_API void btfc_gpu_plan_free(btfc_gpu_plan* plan);

/* SPIR-V 1.3 of an entry point of shaders/, such as "btfc_decode.comp": words, and their size in bytes. NULL
 * where there is none of that name, or btfc was built without glslang. */
BTFC_API const uint32_t* btfc_gpu_shader(const char* name, size_t* size_ret);

#ifdef __cplusplus
}
#endif
#endif
