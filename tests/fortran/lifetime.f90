! Objects that end: by hand, twice, in any order, or by their finaliser; and log lines.
module lifetime_parts
   use checking, only: check
   use gamboge
   use gamboge_context, only: context_of
   use gamboge_tools, only: context_state
   implicit none
   integer, save :: lines = 0

contains

   ! How many objects use the context.
   integer function users(context)
      type(gbg_context_t), intent(in) :: context
      type(context_state), pointer :: state
      state => context_of(context)
      users = 0
      if (associated(state)) users = state%users
   end function users

   subroutine local_objects(context)
      type(gbg_context_t), intent(in) :: context
      type(gbg_scene_t) :: scene
      type(gbg_scene_t), allocatable :: scenes(:)
      allocate (scenes(3))
      call scene%create(context, 2)
      call scenes(1)%create(context, 2)
      call scenes(3)%create(context, 3)
      call check(users(context) == 4, 'three scenes and the context itself')
   end subroutine local_objects

   ! All of these are finalised here, in an order that the compiler chooses.
   subroutine local_context()
      type(gbg_context_t) :: context
      type(gbg_scene_t) :: scene
      call context%create('cpu')
      call scene%create(context, 2)
   end subroutine local_context

   subroutine count_line(level, line)
      integer, intent(in) :: level
      character(*), intent(in) :: line
      call check(level == gbg_log_info .or. level == gbg_log_warning, 'log level')
      call check(len(line) > 0, 'log line')
      lines = lines + 1
   end subroutine count_line
end module lifetime_parts

program lifetime
   use lifetime_parts
   use checking, only: check, finish
   implicit none
   type(gbg_context_t) :: context
   type(gbg_scene_t) :: scene
   integer :: stat

   call scene%destroy()
   call context%destroy()
   call context%create()
   call check(users(context) == 1, 'a context alone')
   call scene%create(context, 2)
   call check(users(context) == 2, 'a scene')
   call scene%destroy()
   call scene%destroy()
   call check(users(context) == 1, 'destroyed twice')
   call local_objects(context)
   call check(users(context) == 1, 'finalised local and allocatable objects')
   call local_context()

   call scene%create(context, 2)
   call context%set_log(count_line)
   call context%set_log()
   call context%destroy()
   call scene%set('run.seed', 3, stat)
   call check(stat == gbg_ok, 'a scene outlives its context')
   call scene%create(context, 2, stat)
   call check(stat == gbg_e_order .or. stat == gbg_e_argument, 'create on top of it')
   call scene%destroy()
   call scene%set('run.seed', 3, stat)
   call check(stat == gbg_e_argument, 'after destroy')
   call context%create('cpu')
   call check(users(context) == 1, 'created again')
   call context%destroy()
   call finish()
end program lifetime
