! L5: the part of the C interface that is sum.h, and what scenes and engines say of long-range sums,
! as it is; module gamboge_c hands it on.
module gamboge_c_sums
   use, intrinsic :: iso_c_binding, only: c_char, c_double, c_int, c_int64_t, c_intptr_t, c_ptr
   implicit none
   public

   interface
      integer(c_int) function gbg_sum_create(context, dimension, lengths, power, kind, tolerance, &
         n, sum) bind(c)
         import
         type(c_ptr), value :: context
         integer(c_int), value :: dimension
         real(c_double), intent(in) :: lengths(*)
         real(c_double), value :: power, tolerance
         character(kind=c_char), intent(in) :: kind(*)
         integer(c_int64_t), value :: n
         type(c_ptr), intent(inout) :: sum
      end function gbg_sum_create

      integer(c_int) function gbg_sum_destroy(sum) bind(c)
         import
         type(c_ptr), intent(inout) :: sum
      end function gbg_sum_destroy

      integer(c_int) function gbg_sum_set_option(sum, option, value) bind(c)
         import
         type(c_ptr), value :: sum
         character(kind=c_char), intent(in) :: option(*), value(*)
      end function gbg_sum_set_option

      integer(c_int) function gbg_sum_set_positions(sum, x, y, z, step) bind(c)
         import
         type(c_ptr), value :: sum, x, y, z
         integer(c_intptr_t), value :: step
      end function gbg_sum_set_positions

      integer(c_int) function gbg_sum_set_sources(sum, alpha) bind(c)
         import
         type(c_ptr), value :: sum
         real(c_double), intent(in) :: alpha(*)
      end function gbg_sum_set_sources

      integer(c_int) function gbg_sum_run(sum) bind(c)
         import
         type(c_ptr), value :: sum
      end function gbg_sum_run

      integer(c_int) function gbg_sum_get_forces(sum, mobility, fx, fy, fz, step) bind(c)
         import
         type(c_ptr), value :: sum, mobility, fx, fy, fz
         integer(c_intptr_t), value :: step
      end function gbg_sum_get_forces

      integer(c_int) function gbg_sum_get_potential(sum, values) bind(c)
         import
         type(c_ptr), value :: sum
         real(c_double), intent(inout) :: values(*)
      end function gbg_sum_get_potential

      integer(c_int) function gbg_sum_get_error(sum, samples, rms_over_rms, rms_over_median) &
         bind(c)
         import
         type(c_ptr), value :: sum
         integer(c_int64_t), value :: samples
         real(c_double), intent(inout) :: rms_over_rms, rms_over_median
      end function gbg_sum_get_error

      integer(c_int) function gbg_sum_describe(sum, capacity, text) bind(c)
         import
         type(c_ptr), value :: sum
         integer(c_int64_t), value :: capacity
         character(kind=c_char), intent(inout) :: text(*)
      end function gbg_sum_describe

      integer(c_int) function gbg_scene_set_force(scene, force, option, value) bind(c)
         import
         type(c_ptr), value :: scene
         integer(c_int), value :: force
         character(kind=c_char), intent(in) :: option(*), value(*)
      end function gbg_scene_set_force

      integer(c_int) function gbg_engine_get_sum(engine, force, tolerance, predicted, measured, &
         refined) bind(c)
         import
         type(c_ptr), value :: engine
         integer(c_int), value :: force
         real(c_double), intent(inout) :: tolerance, predicted, measured
         integer(c_int), intent(inout) :: refined
      end function gbg_engine_get_sum
   end interface
end module gamboge_c_sums
