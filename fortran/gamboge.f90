! L5: the module that a program uses: objects, kernels on the caller's own arrays, constants.
module gamboge
   use gamboge_constants
   use gamboge_context, only: gbg_context_t, gbg_has_component, gbg_log_line, gbg_status_name, &
      gbg_status_text, gbg_version
   use gamboge_scene, only: gbg_scene_option, gbg_scene_t
   use gamboge_engine, only: gbg_engine_t
   use gamboge_trajectory, only: gbg_trajectory_t
   use gamboge_analysis, only: gbg_analysis_t
   use gamboge_neighbours, only: gbg_neighbours_t, gbg_pair_batch
   use gamboge_sum, only: gbg_sum_t
   use gamboge_kernels, only: gbg_overlaps_find, gbg_overlaps_remove, gbg_pair_forces
   use gamboge_noise, only: gbg_normals
   implicit none
   public
end module gamboge
