/* What characters play, for programs of this machine that listen: contextdb live, examples/web, live.tscn. Not on Windows. */

typedef struct publishing {
    cdbl_link link;
    cdbl_bones *bones;              /* of each character */
    const char **names;
    int64_t *parents;
} publishing;

static void stop_publishing(publishing *own)
{
    if (!own) return;
    cdbl_close(&own->link);
    free(own->bones), free(own->names), free(own->parents);
    free(own);
}

/* Listen under a name; NULL where it cannot be. */
static publishing *begin_publishing(const cdbm_crowd *crowd, const char *game)
{
    size_t n = cdbm_crowd_size(crowd, CDBM_N_CHARACTERS), n_joints = cdbm_crowd_size(crowd, CDBM_N_JOINTS), i;
    publishing *own = (publishing *)calloc(1, sizeof *own);
    if (!own || !cdbl_open(&own->link, game)) return free(own), (publishing *)NULL;
    own->bones = (cdbl_bones *)calloc(n, sizeof *own->bones);
    own->names = (const char **)calloc(n_joints + 1, sizeof *own->names);
    own->parents = (int64_t *)calloc(n_joints + 1, sizeof *own->parents);
    if (!own->bones || !own->names || !own->parents) return stop_publishing(own), (publishing *)NULL;
    for (i = 0; i < n_joints; i++) own->names[i] = cdbm_crowd_text(crowd, i, CDBM_JOINT_TEXT), own->parents[i] = cdbm_crowd_parent(crowd, i);
    for (i = 0; i < n; i++) own->bones[i].names = own->names, own->bones[i].parents = own->parents, own->bones[i].n = n_joints;
    return own;
}

static void publish_poses(publishing *own, const cdbm_crowd *crowd)
{
    char who[24];
    size_t n = cdbm_crowd_size(crowd, CDBM_N_CHARACTERS), i;
    if (cdbl_listeners(&own->link) == 0) return;
    for (i = 0; i < n; i++) {
        snprintf(who, sizeof who, "%lu", (unsigned long)i);
        cdbl_pose(&own->link, who, &own->bones[i], cdbm_crowd_text(crowd, i, CDBM_ASSET_TEXT), cdbm_crowd_numbers(crowd, i, CDBM_ROOT_NUMBERS),
            cdbm_crowd_numbers(crowd, i, CDBM_ROTATION_NUMBERS), cdbm_crowd_numbers(crowd, i, CDBM_TRANSLATION_NUMBERS));
    }
}
