! stat and errmsg: what a failure says, what a success leaves alone, objects that are not there.
program failures
   use, intrinsic :: iso_fortran_env, only: int64, real64
   use checking, only: check, check_text, finish
   use gamboge
   implicit none
   type(gbg_context_t) :: context, other
   type(gbg_scene_t) :: scene
   type(gbg_engine_t) :: engine
   type(gbg_trajectory_t) :: trajectory
   character(200) :: errmsg
   character(:), allocatable, save :: text
   integer :: stat
   real(real64) :: x(2, 3), value
   integer(int64) :: many

   errmsg = 'untouched'
   call context%create('nonsense', stat, errmsg)
   call check(stat == gbg_e_name, 'unknown backend')
   call check(index(errmsg, 'gbg_context_create') == 1 .and. index(errmsg, 'nonsense') > 0, &
              'message of an unknown backend: '//trim(errmsg))
   call check(len_trim(context%message()) == len_trim(errmsg), 'message() without a context')

   errmsg = 'untouched'
   call context%create('cpu', stat, errmsg)
   call check(stat == gbg_ok, 'backend cpu')
   call check(errmsg == 'untouched', 'a success changes errmsg')
   call check_text(context%message(), '', 'message of a fresh context')
   call context%create('cpu', stat)
   call check(stat == gbg_e_order, 'create twice')

   call scene%set('dynamics.dt', 0.01_real64, stat, errmsg)
   call check(stat == gbg_e_argument, 'a scene that was not created')
   call check(index(errmsg, 'scene is NULL') > 0, 'its message: '//trim(errmsg))
   call scene%create(other, 2, stat)
   call check(stat == gbg_e_argument, 'scene of a context that was not created')
   call scene%create(context, 4, stat, errmsg)
   call check(stat == gbg_e_argument, 'four dimensions')
   call scene%create(context, 2)
   call check(scene%dimension() == 2, 'dimension')
   call scene%create(context, 3, stat, errmsg)
   call check(stat == gbg_e_order .and. scene%dimension() == 2, 'create twice')
   call scene%set('dynamics.d', 0.01_real64, stat, errmsg)
   call check(stat == gbg_e_name .and. index(errmsg, 'dynamics.dt') > 0, 'nearest name: '//errmsg)
   call check_text(context%message(), trim(errmsg), 'message() of the context')
   call scene%set('dynamics.d', 0.01_real64, errmsg=errmsg(:4), stat=stat)
   call check(errmsg(:4) == 'gbg_', 'errmsg is filled as far as it goes')
   call scene%set_box([1.0_real64], stat=stat)
   call check(stat == gbg_e_argument, 'one length in two dimensions')
   x = 0.5_real64
   call scene%add_particles(x, species=[1, 1], stat=stat, errmsg=errmsg)
   call check(stat == gbg_e_argument .and. index(errmsg, 'species has 2 elements for 3') > 0, &
              'two species for three particles: '//trim(errmsg))
   call scene%add_particles(x(:1, :), stat=stat)
   call check(stat == gbg_e_argument, 'x(1,n)')

   call engine%run(1, stat)
   call check(stat == gbg_e_argument, 'an engine that was not created')
   call engine%get_positions(x, stat=stat)
   call check(stat == gbg_e_argument, 'its positions')
   call engine%get('step', many, stat)
   call check(stat == gbg_e_argument, 'its counters')
   call trajectory%append(engine, stat)
   call check(stat == gbg_e_argument, 'a trajectory that was not created')
   call gbg_normals(other, 1, 0, 0, 0, x, stat)
   call check(stat == gbg_e_argument, 'a kernel without a context')
   call gbg_normals(context, 1, 0, 0.5, 0, x, stat, errmsg)
   call check(stat == gbg_e_argument .and. index(errmsg, 'at_step') > 0, 'a step that is real')

   call gbg_scene_option(1, text, stat)
   call check(stat == gbg_ok .and. index(text, '|') > 1, 'first option')
   call gbg_scene_option(0, text, stat)
   call check(stat == gbg_e_argument, 'option 0')
   call check_text(gbg_status_name(gbg_e_step), 'GBG_E_STEP', 'status name')
   call check(len(gbg_status_text(gbg_e_step)) > 10, 'status text')
   call check(index(gbg_version(), 'gamboge ') == 1, 'version')
   call check(.not. gbg_has_component('teapot'), 'component')
   call scene%get('dynamics.temperature', value)
   call check(abs(value) <= 0, 'default of dynamics.temperature')
   deallocate (text)
   call finish()
end program failures
