/* SPDX-License-Identifier: Apache-2.0 */
/* view/page_files.h -- the files of src/view/page/, embedded as bytes. page_files.cmake generates
   page_files.c at build time. */
#ifndef GBT_VIEW_PAGE_FILES_H
#define GBT_VIEW_PAGE_FILES_H

#include <stddef.h>

typedef struct page_file {
    const char *name; /* "index.html" */
    const unsigned char *bytes;
    size_t count;
} page_file;

/** The file of that name; NULL if there is none. */
const page_file *page_file_find(const char *name);

#endif
