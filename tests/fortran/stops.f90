! Failures without stat: the program ends here, and stops.sh looks at its words and status.
program stops
   use, intrinsic :: iso_fortran_env, only: real64
   use gamboge
   implicit none
   type(gbg_context_t) :: context
   type(gbg_scene_t) :: scene, other
   character(20) :: which
   character(100) :: errmsg
   call get_command_argument(1, which)
   call context%create('cpu')
   call scene%create(context, 2)
   select case (which)
   case ('option')
      call scene%set('dynamics.dz', 0.01_real64)
   case ('errmsg')
      call scene%set('dynamics.dz', 0.01_real64, errmsg=errmsg)
   case ('shape')
      call scene%add_particles(reshape([real(real64) :: 1, 2, 3, 4], [1, 4]))
   case ('copy')
      other = scene
   end select
   print '(a)', 'still running'
end program stops
